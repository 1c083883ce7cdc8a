"""Moser's normal form beside the upper periodic orbit.

Near a hyperbolic periodic orbit a Hamiltonian system of two degrees of freedom is, on a level
of its energy, analytically conjugate to

    du/dpsi = Lambda(I) u,    dv/dpsi = -Lambda(I) v,    I = u v

(J. Moser, Comm. Pure Appl. Math. 9 (1956) 673). Qp and Qm, and the oscillations of time and theta3
about their mean growth, are series in u and v with coefficients periodic in psi. They are found
degree by degree: the terms known so far leave a residual, whose Fourier coefficients are divided
by i n + (j - k) Lambda_0 and the like. The resonant coefficients, with divisor 0, make up Lambda.
They do so twice, in the equation of u and in that of v; the agreement of the two checks the reduced
equations and the arithmetic at once.

Everything is computed at many energies together, and kept as a Chebyshev expansion in the energy.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers import Scalar
from rigidpend.orbits.precision import Precision, precision
from rigidpend.orbits.return_map.expansions import (
    Interval,
    chebyshev_analysis,
    chebyshev_synthesis,
    fourier_analysis,
    fourier_slopes,
    fourier_synthesis,
    phases,
)
from rigidpend.orbits.return_map.jets import Deferred, Jet, Reciprocal, convolved
from rigidpend.orbits.return_map.nome import normalization
from rigidpend.orbits.return_map.reduced import Coefficients, ReducedRates, lift, reduced

MOST_CORRECTIONS = 40
"""Largest number of corrections of the Floquet frame.

Each squares the error of the frame, so that in practice few are made."""


DIVERGED = 1e3
"""Residual of the Floquet frame, per radian, above which corrections are given up."""
GUARD_SHARE = 2.0**-8
"""Error that terms in doubles may add, as a share of one rounding in the full precision."""
FARTHER = 1.3
"""Factor on the radius at which terms are small enough for fewer digits and nodes.

Arcs end up to 1.3 times as far out as without weight. With 1.1 charts of a body drawn by lot erred
five times as much, with 1.2 no more than with all digits and nodes for all terms."""
SPARE_ENERGIES, SPARE_PHASES = 2, 2
"""Nodes of energy and of phase for terms of a high degree, beyond their share of all nodes.

Maps of four bodies err as with all nodes, and so they do with one node of energy."""
SETTLED = 1e-4
"""Residual of the Floquet frame, per radian, below which it counts as found.

Corrections end when they no longer reduce the residual: at rounding, or at the harmonics that too
few phases leave out, which the checks of the finished map judge."""


class MapError(ArithmeticError):
    """Refusal of a map that cannot be built or trusted; the message gives the reason."""


class NormalForm(NamedTuple):
    """The normal form over an interval of energies, as expansions in energy and phase."""

    energies: Interval
    degree: int
    n: int
    """Number of Fourier terms."""
    odd: Any
    """(count n, 2 or 3, terms): Qp, Qm, and the oscillation of theta3 if that is asked for.

    `count` is the number of Chebyshev polynomials of the energy; the phase runs fastest. Terms are
    those of :func:`powers`."""
    even: Any
    """(count n, terms): the oscillation of the time t' about its mean growth."""
    exponent: Any
    """(count, K): the coefficients of Lambda(I), radians^-1."""
    rotation: Any
    """(count, K + 1): the coefficients of dt'/dpsi, averaged, as a series in I."""
    radius: float
    """Largest |u| and |v|."""
    disagreement: float
    """Largest difference between the two determinations of Lambda at |u| = |v| = `radius`.

    It is relative to Lambda_0."""

    @property
    def series(self) -> tuple[Any, Any]:
        """The odd and the even series in one shape, (count n, F, terms)."""
        return self.odd, self.even[:, None]

    @property
    def theta3(self) -> bool:
        """True if theta3 is among the series."""
        return bool(self.odd.shape[1] == 3)


def powers(degree: int, parity: int) -> Any:
    """The exponents (j, k) of the terms u^j v^k with j + k <= degree of one parity: (terms, 2)."""
    found = [(j, D - j) for D in range(parity, degree + 1, 2) for j in range(D + 1)]
    return np.array(found)


def normal_form(
    c: Coefficients,
    energies: Interval,
    degree: int,
    n: int,
    radius: float,
    a: Precision,
    *,
    theta3: bool = True,
    least_share: float = 0.0,
) -> NormalForm:
    """Find the normal form up to a total degree, from values at n phases.

    Parameters
    ----------
    degree : int
        The largest j + k of u^j v^k in Qp and Qm, odd; time goes one degree lower.
    n : int
        Number of phases, odd.
    radius : float
        Largest |u| and |v| at which the series will be used.
    least_share : float, optional
        The degree is not raised further once its terms at the radius, relative to those of
        degree 1, are below this.

    Raises
    ------
    MapError
        The periodic orbit is not hyperbolic with a positive multiplier.
    """
    f = normalization(c, float(energies.centre), degree // 2 + 1)
    finder = _Finder(c, energies.nodes(a), n, f, a)
    for D in range(1, degree + 1, 2):
        if D > 1:
            finder.extend(D)
        if theta3:
            finder.extend_mean(D, 2, finder.sigma)
        finder.found[5].append(finder.extend_mean(D - 1, 3, finder.tau))
        share = finder.share(D, radius)
        if share < least_share:
            break
        finder.go_on_roughly(finder.share(D, FARTHER * radius))
    return finder.record(energies, D, radius)


class _Momentum(Jet):
    """J2 as a series, from the energy: kappa/2 J2^2 - Qp Qm/2 + mu r . gamma = h."""

    def __init__(
        self, tape: list[Jet], h: Scalar, turn: Scalar, c: Coefficients, a: Precision
    ) -> None:
        super().__init__(tape, 0)
        self.kappa = c.aligned.kappa
        # On the periodic orbit itself Qp = Qm = 0.
        self.parts[0] = a.sqrt(2 * (h - lift(turn, c)) / self.kappa)[None]
        self.product: Jet
        self.drop: Jet

    def find(self, degree: int) -> Any:
        # In this degree the energy reads, with mu r . gamma = lift - drop,
        # kappa J2_0 J2_D + kappa/2 (sum over 0 < i < D of J2_i J2_(D-i)) = (Qp Qm)_D/2 + drop_D.
        left = self.product.part(degree) / 2 + self.drop.part(degree)
        if degree > 2:
            square = convolved(self, self, degree, range(2, degree, 2))
            left = left - self.kappa / 2 * square
        return left / (self.kappa * self.parts[0])

    def go_on(self, rougher: Callable[[Any], Any]) -> None:
        super().go_on(rougher)
        self.kappa = rougher(self.kappa)


class _Finder:
    """Solver for the normal form: the reduced equations as series, and the terms found so far.

    Parts of series are arrays (D + 1, n, H): powers j of u^j v^(D-j), phases, energies.
    """

    def __init__(self, c: Coefficients, h: Scalar, n: int, f: Any, a: Precision) -> None:
        self.f, self.whole = f, (a, n, len(h))
        self._use(*self.whole)
        psi = phases(n, a)[:, None]
        self.turn = a.cos(psi), a.sin(psi)
        self.slope = fourier_slopes(self.synthesis) @ self.analysis
        self.Q, self.flow = self._series(c, h)
        self.tau, self.sigma, self.exponent = dict[int, Any](), dict[int, Any](), list[Any]()
        self.found: tuple[list[Any], ...] = ([], [], [], [], [], [])
        """Parts as found, by ascending degree: Qp, Qm, theta3, t, Lambda and the mean dt'/dpsi."""
        self._begin()

    def _series(self, c: Coefficients, h: Scalar) -> tuple[list[Jet], list[Jet]]:
        """The series Qp and Qm, still empty; and d/dpsi of Qp, Qm, theta3 and t along the flow."""
        self.tape: list[Jet] = []
        Q = [Jet(self.tape, 1), Jet(self.tape, 1)]
        J2 = _Momentum(self.tape, h, self.turn, c, self.a)
        # The series depend on one another in a circle: the rates need 1/J2 and 1/S, and J2 and
        # M3 need parts of the rates. But M1^2 + M2^2, Qp Qm and `drop` begin with degree 2, so
        # that a part of J2 or M3 of degree D takes parts of 1/J2 and 1/S up to degree D - 2 only.
        per_J2, per_S, per_rate = (Reciprocal(self.tape) for _ in range(3))
        M3 = Deferred(self.tape, 0)
        rates: ReducedRates = reduced(Q, self.turn, (J2, M3, per_J2, per_S), c)
        # J2 - M3 = (M1^2 + M2^2)/(J2 + M3).
        M3.of = J2 - rates.across * per_S
        J2.product, J2.drop = rates.product, rates.drop
        per_J2.of, per_S.of, per_rate.of = J2, J2 + M3, rates.psi
        return Q, [*(per_rate * rate for rate in (rates.Qp, rates.Qm, rates.theta3)), per_rate]

    def _begin(self) -> None:
        """Find the linear part: the Floquet frame P and Lambda_0.

        In the frame the linear equations have the matrix diag(Lambda_0, -Lambda_0). The residual
        beside this matrix is removed to first order in each correction, so its size is squared.
        """
        one, zero = np.ones_like(self.flow[3].part(0)[0]), np.zeros_like(self.flow[3].part(0)[0])
        # In degree 1 the powers are v, u; without weight v is Qp and u is Qm.
        self.Q[0].parts[1], self.Q[1].parts[1] = np.stack((one, zero)), np.stack((zero, one))
        # (Qp, Qm)' = A (Qp, Qm), as Qp = v and Qm = u here; the columns of P belong to u and v.
        A = np.stack([self.flow[i].part(1) for i in (0, 1)])
        P = np.stack([np.stack((zero, one)), np.stack((one, zero))])
        exponent = self._mean(A[1, 1])
        size = float("inf")
        for _ in range(MOST_CORRECTIONS):
            # The residual beside the matrix diag(exponent, -exponent).
            rest = _product(_inverse(P), _product(A, P) - np.matmul(self.slope, P))
            rest[0, 0] = rest[0, 0] - exponent
            rest[1, 1] = rest[1, 1] + exponent
            before, size = size, self.a.largest(rest)
            if (size < SETTLED and size > before / 2) or not size < DIVERGED:
                break
            found = self._mean(rest[0, 0]) - self._mean(rest[1, 1])
            exponent = exponent + found / 2
            # P (1 + X) removes the residual to first order if X' + (d_j - d_i) X = residual, with
            # d = (Lambda_0, -Lambda_0). On the diagonal only the mean, now in Lambda_0, remains.
            X = self._divided(rest, np.array([[0, -2], [2, 0]])[:, :, None, None] * exponent)
            P = P + P[:, 0, None] * X[0] + P[:, 1, None] * X[1]
        if not size < SETTLED:
            raise MapError(
                "no Floquet frame is found: mu is too large, or the orbit not hyperbolic"
            )
        # The powers of degree 1 are in the order v, u.
        self._settle(1, [row[::-1] for row in P], exponent)
        self.P, self.inverse = P, _inverse(P)
        # The flow preserves an area, so the two diagonal means have to cancel: the first check.
        self.difference = [self._mean(rest[0, 0]) + self._mean(rest[1, 1])]

    def extend(self, D: int) -> None:
        """Find Qp and Qm in degree D, and the next coefficient of Lambda."""
        # With zero for the unknown terms, the flow's part of degree D is the residual that the
        # terms of lower degrees leave; multiplied by P^-1 it belongs to u and v.
        self._tell(D, [np.zeros_like(self.P, shape=(D + 1, *self.P.shape[2:]))] * 2)
        known = [self._beside(flow, D, Q.parts) for flow, Q in zip(self.flow, self.Q, strict=False)]
        rest = [row[0] * known[0] + row[1] * known[1] for row in self.inverse]
        # The resonant terms are u I^k and v I^k: no divisor is left for their means.
        k = D // 2
        growth, decay = self._mean(rest[0][k + 1]), -self._mean(rest[1][k])
        self.difference.append(growth - decay)
        # lean = j - k of u^j v^k. Times Lambda_0 it stays an exact 0 in the resonant rows, where
        # `_divided` leaves the mean out.
        lean = 2 * np.arange(D + 1)[:, None, None] - D
        u, v = (
            self._divided(r, (lean + side) * self.exponent[0])
            for r, side in zip(rest, (-1, 1), strict=True)
        )
        # The resonant rows of u and v, which no equation determines, choose the invariant.
        u[k + 1], v[k] = u[k + 1] + self.f[k], v[k] + self.f[k]
        self._settle(D, [row[0] * u + row[1] * v for row in self.P], (growth + decay) / 2)

    def extend_mean(self, D: int, which: int, known: dict[int, Any]) -> Any:
        """Find the oscillation of theta3 (2) or t (3) in degree D; return its mean rate, (H,).

        None in odd degrees, in which no term is resonant.
        """
        rest = self._beside(self.flow[which], D, known)
        lean = 2 * np.arange(D + 1)[:, None, None] - D
        known[D] = self._divided(rest, lean * self.exponent[0])
        self.found[which].append(known[D])
        return None if D % 2 else self._mean(rest[D // 2])

    def share(self, D: int, radius: float) -> float:
        """The size of the terms of degree D relative to degree 1, where |u|, |v| <= radius."""
        first, last = (max(self.a.largest(Q.parts[k]) for Q in self.Q) for k in (1, D))
        return last / first * radius ** (D - 1)

    def go_on_roughly(self, share: float) -> None:
        """Go on with fewer nodes and in doubles, if these are enough beyond terms of this `share`.

        The smaller a term is, the fewer digits it needs. Terms shrink with the sum of their orders
        in u and v, energy and phase, so that it needs as much fewer orders of the latter two.
        """
        whole, phases_, energies = self.whole
        # Binary digits of a term of size 1, and those that terms of this share need.
        all_digits = whole.bits - math.log2(GUARD_SHARE)
        digits = max(0.0, all_digits + math.log2(max(share, 1e-300)))
        left, a = digits / all_digits, precision(53) if digits < 53 else whole
        n = min(self.n, 2 * math.ceil(left * phases_ / 2) + 1 + SPARE_PHASES)
        H = min(self.H, math.ceil(left * energies) + SPARE_ENERGIES)
        # Known terms are all taken to new nodes: only for a third of the nodes does that pay.
        if a is self.a and 3 * n * H > 2 * self.n * self.H:
            return
        by_phase = fourier_synthesis(n, self.n, a) @ fourier_analysis(self.n, a)
        by_energy = (chebyshev_synthesis(H, self.H, a) @ chebyshev_analysis(self.H, a)).T

        def rougher(x: Any) -> Any:
            """Numbers, (H,), (n, 1) or (..., n, H), in the new precision and at the new nodes."""
            x = self.a.floats(x) if a.bits == 53 else x
            if len(np.shape(x)) > 1:
                x = np.matmul(by_phase, x)
            return np.matmul(x, by_energy) if np.shape(x)[-1:] == (self.H,) else x

        for jet in self.tape:
            jet.go_on(rougher)
        for found in (self.sigma, self.tau):
            found.update({D: rougher(part) for D, part in found.items()})
        self.exponent = [rougher(x) for x in self.exponent]
        self.P, self.inverse = rougher(self.P), rougher(self.inverse)
        self._use(a, n, H)

    def _use(self, a: Precision, n: int, H: int) -> None:
        """Take a precision and numbers of phases and energies for the terms from now on."""
        self.a, self.n, self.H = a, n, H
        self.analysis, self.synthesis = fourier_analysis(n, a), fourier_synthesis(n, n, a)

    def _settle(self, D: int, parts: list[Any], exponent: Any) -> None:
        """Keep the parts of degree D of Qp and Qm, and the next coefficient of Lambda."""
        self._tell(D, parts)
        self.exponent.append(exponent)
        for which, part in ((0, parts[0]), (1, parts[1]), (4, exponent)):
            self.found[which].append(part)

    def _tell(self, D: int, parts: list[Any]) -> None:
        """Set the parts of degree D of Qp and Qm."""
        # Parts of this degree that other series have found rest on the former Qp and Qm.
        for jet in self.tape:
            jet.parts.pop(D, None)
        for Q, part in zip(self.Q, parts, strict=True):
            Q.parts[D] = part

    def _beside(self, flow: Jet, D: int, parts: dict[int, Any]) -> Any:
        """The residual of degree D: `flow` less the known terms of Lambda beyond Lambda_0.

        Along du/dpsi = Lambda u, dv/dpsi = -Lambda v a term c u^j v^k changes by (j - k) Lambda c.
        """
        # A copy, for a series keeps its parts.
        rest = flow.part(D) + 0
        for k, rate in enumerate(self.exponent[1:], 1):
            # Lambda_k I^k raises a degree by 2 k, and the power of u by k.
            d = D - 2 * k
            if d in parts:
                lean = 2 * np.arange(d + 1)[:, None, None] - d
                rest[k : k + d + 1] -= rate * lean * parts[d]
        return rest

    def _mean(self, x: Scalar) -> Any:
        """The mean over the phases, (..., H), of values (..., n, H)."""
        return x.sum(axis=-2) / self.n

    def _divided(self, x: Scalar, rate: Scalar) -> Any:
        """The periodic solution y of y' + rate y = x.

        Where rate = 0 the mean of x is left out, and that of y is 0.
        """
        found = np.matmul(self.analysis, x)
        rate = rate + np.zeros_like(found[..., :1, :])
        zero = (rate == 0)[..., 0, :]
        first = found[..., 0, :] / np.where(zero, 1, rate[..., 0, :])
        # For x = cos, sin coefficients (c, s) of harmonic k those of y are (A, B) with
        # rate A + k B = c and rate B - k A = s.
        k = np.arange(1, self.n // 2 + 1)[:, None]
        size = rate * rate + k * k
        cos, sin = found[..., 1::2, :], found[..., 2::2, :]
        found[..., 1::2, :], found[..., 2::2, :] = (
            (rate * cos - k * sin) / size,
            (rate * sin + k * cos) / size,
        )
        found[..., 0, :] = np.where(zero, 0, first)
        return np.matmul(self.synthesis, found)

    def record(self, energies: Interval, degree: int, radius: float) -> NormalForm:
        """The normal form as expansions in energy and phase."""
        *odd, tau = (self._expanded(x) for x in self.found[:4] if x)
        # The rates have one phase, so to speak.
        exponent, rotation = (self._expanded([x[None, None] for x in y]) for y in self.found[4:])
        rate = self.a.largest(self.exponent[0])
        off = [self.a.largest(x) * radius ** (2 * k) / rate for k, x in enumerate(self.difference)]
        series = np.stack(odd, axis=1), tau, exponent, rotation
        return NormalForm(energies, degree, self.whole[1], *series, radius, max(off))

    def _expanded(self, parts: list[Any]) -> Any:
        """The coefficients (H n, terms) in energy and phase, from parts at nodes of both."""
        a, _, energies = self.whole
        n, first = parts[0].shape[-2], 0
        # Laid out as they are kept: a map that was read again has to round as one that is new.
        found = a.zeros((energies, n, sum(len(x) for x in parts)))
        for part in parts:
            _, few, H = part.shape
            c = np.matmul(fourier_analysis(few, a), a.array(part))
            c = np.matmul(c, chebyshev_analysis(H, a).T)
            found[:H, :few, first : first + len(part)] = c.transpose(2, 1, 0)
            first += len(part)
        return found.reshape(energies * n, first)


def _product(A: Any, B: Any) -> Any:
    """The product of two matrices (2, 2, ...)."""
    return A[:, 0, None] * B[0] + A[:, 1, None] * B[1]


def _inverse(P: Any) -> Any:
    """The inverse of a matrix (2, 2, ...)."""
    (a, b), (c, d) = P
    determinant = a * d - b * c
    rows = (d / determinant, -b / determinant), (-c / determinant, a / determinant)
    return np.stack([np.stack(row) for row in rows])
