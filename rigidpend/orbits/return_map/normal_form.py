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

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers import Scalar
from rigidpend.orbits.return_map.expansions import (
    Interval,
    chebyshev_analysis,
    fourier_analysis,
    fourier_slopes,
    fourier_synthesis,
    phases,
)
from rigidpend.orbits.return_map.jets import Jet, Reciprocal, convolved
from rigidpend.orbits.return_map.precision import Precision
from rigidpend.orbits.return_map.reduced import Coefficients, ReducedRates, lift, reduced

MOST_CORRECTIONS = 40
"""Largest number of corrections of the Floquet frame.

Each squares the error of the frame, so that in practice few are made."""


DIVERGED = 1e3
"""Residual of the Floquet frame, per radian, above which corrections are given up."""
GUARD_SHARE = 2.0**-8
"""Error that terms in doubles may add, as a share of one rounding in the full precision."""
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
    finder = _Finder(c, energies.nodes(a), n, a)
    for D in range(1, degree + 1, 2):
        if D > 1:
            finder.extend(D)
        if theta3:
            finder.extend_mean(D, 2, finder.sigma)
        finder.rotation.append(finder.extend_mean(D - 1, 3, finder.tau))
        share = finder.share(D, radius)
        if share < least_share:
            break
        # A rounding in doubles of a term of this size, or smaller, is below GUARD_SHARE of one of
        # the whole in the full precision.
        if not finder.sharp and share < GUARD_SHARE * 2.0 ** (53 - a.bits):
            finder.go_on_in_doubles()
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

    def go_on_in_doubles(self, a: Precision) -> None:
        super().go_on_in_doubles(a)
        self.kappa = float(self.kappa)


class _Finder:
    """Solver for the normal form: the reduced equations as series, and the terms found so far.

    Parts of series are arrays (D + 1, n, H): powers j of u^j v^(D-j), phases, energies.
    """

    def __init__(self, c: Coefficients, h: Scalar, n: int, a: Precision) -> None:
        self.a, self.n = a, n
        psi = phases(n, a)[:, None]
        self.turn = a.cos(psi), a.sin(psi)
        self.analysis = fourier_analysis(n, a)
        self.synthesis = fourier_synthesis(n, n, a)
        self.slope = fourier_slopes(self.synthesis) @ self.analysis
        self.Q, self.flow = self._series(c, h)
        self.tau: dict[int, Any] = {}
        self.sigma: dict[int, Any] = {}
        self.rotation: list[Any] = []
        self.sharp: list[list[Any]] = []
        """The parts found in the full precision, in the order of `_found`; empty before doubles."""
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
        # J2 - M3 = (M1^2 + M2^2)/(J2 + M3).
        M1, M2 = c.momenta(*Q)
        M3 = J2 - (M1 * M1 + M2 * M2) * per_S
        rates: ReducedRates = reduced(Q, self.turn, (J2, M3, per_J2, per_S), c)
        J2.product, J2.drop = Q[0] * Q[1], rates.drop
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
        A = [self.flow[i].part(1) for i in (0, 1)]
        P = [[zero, one], [one, zero]]
        exponent = self._mean(A[1][1])
        size = float("inf")
        for _ in range(MOST_CORRECTIONS):
            rest = self._left(A, P, exponent)
            before, size = size, max(self.a.largest(x) for row in rest for x in row)
            if (size < SETTLED and size > before / 2) or not size < DIVERGED:
                break
            found = self._mean(rest[0][0]) - self._mean(rest[1][1])
            exponent = exponent + found / 2
            # P (1 + X) removes the residual to first order if X' + (d_j - d_i) X = residual, with
            # d = (Lambda_0, -Lambda_0). On the diagonal only the mean, now in Lambda_0, remains.
            X = [
                [self._divided(rest[i][j], (j - i) * 2 * -exponent) for j in (0, 1)] for i in (0, 1)
            ]
            P = [[row[j] + row[0] * X[0][j] + row[1] * X[1][j] for j in (0, 1)] for row in P]
        if not size < SETTLED:
            raise MapError("no Floquet frame is found: the periodic orbit is not hyperbolic")
        # The powers of degree 1 are in the order v, u.
        self._tell(1, [np.stack((row[1], row[0])) for row in P])
        self.inverse = _inverse(P)
        self.P, self.exponent = P, [exponent]
        # The flow preserves an area, so the two diagonal means have to cancel: the first check.
        self.difference = [self._mean(rest[0][0]) + self._mean(rest[1][1])]

    def _left(self, A: Any, P: Any, exponent: Scalar) -> Any:
        """The residual P^-1 (A P - P') - diag(exponent, -exponent) of a frame, (2, 2, n, H)."""
        columns = [
            [A[i][0] * P[0][j] + A[i][1] * P[1][j] - np.matmul(self.slope, P[i][j]) for i in (0, 1)]
            for j in (0, 1)
        ]
        found = [[a * x + b * y for x, y in columns] for a, b in _inverse(P)]
        found[0][0] = found[0][0] - exponent
        found[1][1] = found[1][1] + exponent
        return found

    def extend(self, D: int) -> None:
        """Find Qp and Qm in degree D, and the next coefficient of Lambda."""
        # With zero for the unknown terms, the flow's part of degree D is the residual that the
        # terms of lower degrees leave; multiplied by P^-1 it belongs to u and v.
        like = self.P[0][0]
        self._tell(D, [np.zeros_like(like, shape=(D + 1, *like.shape))] * 2)
        known = [self._beside(flow, D, Q.parts) for flow, Q in zip(self.flow, self.Q, strict=False)]
        (a, b), (c, d) = self.inverse
        rest = [a * known[0] + b * known[1], c * known[0] + d * known[1]]
        # The resonant terms are u I^k and v I^k: no divisor is left for their means.
        k = D // 2
        growth, decay = self._mean(rest[0][k + 1]), -self._mean(rest[1][k])
        self.exponent.append((growth + decay) / 2)
        self.difference.append(growth - decay)
        # lean = j - k of u^j v^k. Times Lambda_0 it stays an exact 0 in the resonant rows, where
        # `_divided` leaves the mean out.
        lean = 2 * np.arange(D + 1)[:, None, None] - D
        u, v = (
            self._divided(r, (lean + side) * self.exponent[0])
            for r, side in zip(rest, (-1, 1), strict=True)
        )
        self._tell(D, [row[0] * u + row[1] * v for row in self.P])

    def extend_mean(self, D: int, which: int, found: dict[int, Any]) -> Any:
        """Find the oscillation of theta3 or t in degree D; return the mean of its rate, (H,).

        None in odd degrees, in which no term is resonant.
        """
        rest = self._beside(self.flow[which], D, found)
        lean = 2 * np.arange(D + 1)[:, None, None] - D
        found[D] = self._divided(rest, lean * self.exponent[0])
        return None if D % 2 else self._mean(rest[D // 2])

    def share(self, D: int, radius: float) -> float:
        """The size of the terms of degree D relative to degree 1, where |u|, |v| <= radius."""
        first, last = (max(self.a.largest(Q.parts[k]) for Q in self.Q) for k in (1, D))
        return last / first * radius ** (D - 1)

    def go_on_in_doubles(self) -> None:
        """Round the known terms: further ones are so small that doubles have digits enough.

        The known terms in the full precision are kept for :meth:`record`.
        """
        self.sharp, floats = self._found(), self.a.floats
        for jet in self.tape:
            jet.go_on_in_doubles(self.a)
        for found in (self.sigma, self.tau):
            found.update({D: floats(part) for D, part in found.items()})
        self.exponent = [floats(x) for x in self.exponent]
        self.P, self.inverse = (
            [[floats(x) for x in row] for row in y] for y in (self.P, self.inverse)
        )
        self.analysis, self.synthesis = floats(self.analysis), floats(self.synthesis)

    def _found(self) -> list[list[Any]]:
        """Lists of parts by ascending degree: Qp, Qm, theta3, t, Lambda and the mean dt'/dpsi."""
        parts = self.Q[0].parts, self.Q[1].parts, self.sigma, self.tau
        return [*([x[D] for D in sorted(x)] for x in parts), [*self.exponent], [*self.rotation]]

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
        a, to_energy = self.a, chebyshev_analysis(energies.n, self.a).T
        found = self._found()
        # Of the terms that were rounded to doubles, those of the full precision are taken again.
        for sharp, all_ in zip(self.sharp, found, strict=False):
            all_[:] = [*sharp, *map(a.array, all_[len(sharp) :])]
        analysis = fourier_analysis(self.n, a)
        *odd, tau = (_expanded(x, analysis, to_energy) for x in found[:4] if x)
        exponent, rotation = ((np.stack(x) @ to_energy).T for x in found[4:])
        rate = float(abs(self.exponent[0]).max())
        off = [a.largest(x) * radius ** (2 * k) / rate for k, x in enumerate(self.difference)]
        series = np.stack(odd, axis=1), tau, exponent, rotation
        return NormalForm(energies, degree, self.n, *series, radius, max(off))


def _inverse(P: Any) -> list[list[Any]]:
    """The inverse of a matrix (2, 2, ...)."""
    (a, b), (c, d) = P
    determinant = a * d - b * c
    return [[d / determinant, -b / determinant], [-c / determinant, a / determinant]]


def _expanded(parts: list[Any], analysis: Any, to_energy: Any) -> Any:
    """The coefficients (H n, terms) in energy and phase, from parts at nodes of both."""
    values = np.concatenate(parts)
    coefficients = np.matmul(analysis, values) @ to_energy
    return coefficients.transpose(2, 1, 0).reshape(-1, len(values))
