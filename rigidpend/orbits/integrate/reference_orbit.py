"""Reference orbits: one orbit in high precision, step by step, beside which others are followed.

For a neighbour at a distance d the reference needs enough bits to tell the two apart, and to give d
its own digits. As d grows, fewer bits suffice: the precision falls as the tangent grows, which is
the derivative of the orbit along the family of its neighbours. The same holds for a single orbit in
many bits, because its rounding errors grow as much.

Differences from the reference are found without cancellation. The field is quadratic, f(x) = L x +
B(x, x) with B symmetric, so that the difference d = x - X of an orbit x from a reference orbit X
obeys

    d' = L d + B(d, 2 X + d).

Nothing cancels here however small d is: d keeps its relative precision, and the reference needs no
more digits than d has. L and B are derived from :func:`rigidpend.mechanics.equations.aligned`.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations_with_replacement, islice
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients, aligned_along
from rigidpend.numbers import Array
from rigidpend.numbers.exact import GUARD_BITS
from rigidpend.orbits import joined
from rigidpend.orbits.integrate import Crossings, Orbits, in_turn, no_crossings, silent_outcome
from rigidpend.orbits.integrate.arithmetic import PAIRS, in_kernel, rung
from rigidpend.orbits.integrate.batch import advance, written
from rigidpend.orbits.integrate.step_crossings import TOUCH, UNDECIDED, crossings_of_series, touch

BLOCK = 8
"""Number of steps that are taken at a time, all in one precision."""
PARTS = 3
"""Parts into which a step of the integers is divided, being too long for a tangent in doubles."""
MOST_STEPS = 10_000_000
"""Steps after which an orbit counts as failed: some 300,000 passages."""
TINY = 2.0**-800
"""Factor that makes a tangent a difference so small that its square vanishes beside it."""
SIZE = 6
"""Number of aligned components."""
MORE_TERMS = 4
"""Number of terms of a difference's series beyond those that the reference's own would need."""


class Point(NamedTuple):
    """End of a step of a reference orbit, or its start."""

    exact_time: Fraction
    """t' since the start."""
    state: tuple[Fraction, ...]
    """The six aligned components."""
    time: float
    """The time rounded."""
    step: float
    """Length t' of the step that ends here."""
    doubles: Array
    """The components rounded, (6,)."""


Passed: TypeAlias = tuple[float, int]
"""A crossing of M3 = 0: t' since the start, and the separatrix.

The time is the double nearest to the true one, except for a rare last bit."""
Bilinear: TypeAlias = tuple[Array, Any, Any, Array]
"""L (6, 6), the indices i and j, (m,) each, of the products x_i y_j in B, their factors (6, m)."""


def crossings(orbits: Orbits, bits: int, engine: str, tolerance: float) -> Crossings:
    """Crossings of orbits, one by one, in a precision that begins with `bits` bits and falls.

    The tangent that tells how fast the precision may fall is as large as the state in every
    component, as roundings are, so that it contains a part of every growing direction. `GUARD_BITS`
    keep roundings below the error that is allowed. `bits` are relative to the smallest initial
    component.
    """
    found = []
    for state in orbits.states.T:
        # Beside a periodic orbit components are tiny. A tangent of the size of |M| would grow by as
        # much as they do until they are large, though no error of theirs has grown by then.
        least = min((abs(x) for x in state if x), default=1)
        orbit = ReferenceOrbit(
            orbits.coefficients,
            state,
            [max(abs(x), least) for x in state],
            longest=orbits.passage_limit,
            engine=engine,
            bits=bits + GUARD_BITS,
            tolerance=tolerance,
        )
        found.append(orbit.followed(orbits.n_crossings))
    return joined(found)


@dataclass(eq=False)
class ReferenceOrbit:
    """An orbit in high precision, continued as far as it is asked for.

    Each block of steps is computed in the next `rung`, pairs of doubles at least; integers serve
    where the engine's numbers end.
    """

    coefficients: AlignedCoefficients
    """Fractions, as the state."""
    state: Sequence[Fraction]
    """The six aligned components at time 0."""
    tangent: Sequence[Fraction]
    """The state's derivative along the family of neighbours; it is carried on in doubles."""
    longest: float
    """Longest wait for the next crossing, t', after which the orbit is not continued."""
    engine: str
    bits: int
    """The precision that is needed at time 0."""
    tolerance: float
    """That of a compiled Taylor series in 53 bits; every further bit halves it."""

    def __post_init__(self) -> None:
        begin = np.array(self.state, dtype=float)
        self.points = [Point(Fraction(0), tuple(self.state), 0.0, 0.0, begin)]
        """The ends of the known steps, behind the start."""
        self.crossings: list[list[Passed]] = []
        """The crossings on each of the steps."""
        self._field = bilinear(self.coefficients)
        self._units = _units(self.state)
        self._last = 0.0
        self.tangents = [np.array(self.tangent, dtype=float)]
        self.growth = [float(self.size(self.tangents[0][:, None])[0])]
        """The size of the tangent at each point."""

    def reaches(self, k: int) -> bool:
        """Continue the orbit to point k; False if it has waited too long for a crossing before."""
        while k >= len(self.points):
            if self.points[-1].time - self._last > self.longest:
                return False
            self._extend()
        return True

    def series(self, k: int, differences: Array, tolerance: float) -> Array:
        """Series (order + 1, 6, 1 + n) of the orbit and of differences on the step from point k.

        Column 0 is the orbit's own, the others belong to the `differences` (6, n). Coefficients are
        doubles, of the powers of the share of the step.
        """
        # Steps are the radius of convergence over e^2, in any precision: an order gains two nats.
        order = math.ceil(-math.log(tolerance) / 2) + MORE_TERMS
        linear, left_of, right_of, weights = self._field
        n = 1 + differences.shape[1]
        terms = np.empty((order + 1, SIZE, n))
        terms[0, :, 0], terms[0, :, 1:] = self.points[k].doubles, differences
        left, right = np.empty((2, order, len(left_of), n))
        for j in range(order):
            now = terms[j]
            total = now + 2 * now[:, :1]
            # The reference itself is a difference from X = 0, so that its total is d, not 2 X + d.
            total[:, 0] = now[:, 0]
            # `left` and `right` keep d_i and (2 X + d)_j of all orders. B's term of order j is the
            # Cauchy product, with the orders of the right factor descending.
            now.take(left_of, axis=0, out=left[j], mode="clip")
            total.take(right_of, axis=0, out=right[j], mode="clip")
            products = np.einsum("kpn,kpn->pn", left[: j + 1], right[j::-1])
            terms[j + 1] = (linear @ now + weights @ products) / (j + 1)
        return terms * (self.points[k + 1].step ** np.arange(order + 1))[:, None, None]

    def size(self, differences: Any) -> Any:
        """Largest component of each difference (6, n), relative to |M| or |gamma| at the start."""
        return (np.abs(differences) * self._units[:, None]).max(axis=0)

    def last_below(self, size: float) -> int:
        """The last point up to which the tangent has always been smaller than `size`; 0 if none."""
        k = 0
        while self.reaches(k + 1) and self.growth[k + 1] < size:
            k += 1
        return k

    def followed(self, n_crossings: int) -> Crossings:
        """The first crossings; FAILED from where they do not rise and fall in turn."""
        found, rows = no_crossings(n_crossings, 1), list[Any]()
        for k in range(MOST_STEPS):
            if not self.reaches(k + 1):
                found.outcome[0] = silent_outcome(*self.points[-1].state[:2])
                break
            rows += [(0, *passed) for passed in self.crossings[k]]
            if len(rows) >= n_crossings or (rows and rows[-1][2] == UNDECIDED):
                break
        written(np.reshape(rows, (-1, 3)).T, found, self.longest)
        return in_turn(found)

    def bits_at(self, k: int) -> float:
        """Bits that the orbit needs from a known point on."""
        # The bits by which the tangent has grown are no longer needed. Its largest size counts:
        # bits that were dropped do not come back when it shrinks.
        return self.bits - math.log2(max(self.growth[: k + 1]) / self.growth[0])

    def _extend(self) -> None:
        """Continue the orbit by a block of steps, with tangents and crossings."""
        first = len(self.points) - 1
        begin = self.points[first]
        for time, state in self.advanced(begin.state, rung(max(PAIRS, self.bits_at(first)))):
            last, here = self.points[-1].exact_time, begin.exact_time + time
            doubles = np.array(state, dtype=float)
            self.points.append(Point(here, state, float(here), float(here - last), doubles))
        for k in range(first, len(self.points) - 1):
            self._carry_tangent(k)

    def advanced(self, state: Sequence[Fraction], bits: int) -> Any:
        """Times t' since `state` and states, Fractions, at the ends of a block of steps."""
        if in_kernel(self.engine, bits):
            return advance(self.coefficients, state, BLOCK, bits, self.tolerance)
        from rigidpend.orbits.integrate import bigint

        taken = islice(bigint.steps(self.coefficients, state, bits), BLOCK)
        return [(step.time(at), step.at(at)) for step in taken for at in step.parts(PARTS)]

    def _carry_tangent(self, k: int) -> None:
        """Carry the tangent over step k, and find the orbit's crossings there."""
        # The tangent obeys the linear part of the equation of differences; scaled down by TINY it
        # is a difference whose square underflows.
        series = self.series(k, TINY * self.tangents[k][:, None], self.tolerance)
        depth = TOUCH * float(np.linalg.norm(series[0, :3, 0]))
        found = list(crossings_of_series(series[:, :3, 0].T, depth))
        if any(separatrix == UNDECIDED for _, separatrix in found):
            found = self._finely(k)
        began, step = self.points[k].exact_time, self.points[k + 1].step
        self.crossings.append([(float(began + Fraction(x * step)), s) for x, s in found])
        self._last = max([self._last, *(time for time, _ in self.crossings[-1])])
        self.tangents.append(summed(series)[:, 1] / TINY)
        self.growth.append(float(self.size(self.tangents[-1][:, None])[0]))

    def _finely(self, k: int) -> list[tuple[float, int]]:
        """The crossings on step k, decided in integers of as many bits as are needed there."""
        from rigidpend.orbits.integrate import bigint

        bits = math.ceil(self.bits_at(k))
        step = next(bigint.steps(self.coefficients, self.points[k].state, bits))
        length = step.since_begin(self.points[k + 1].exact_time - self.points[k].exact_time)
        return list(step.crossings(length, touch(bits - GUARD_BITS)))


def reference_bits(finest: float, bits: int) -> int:
    """Bits of a reference orbit for neighbours at distances from `finest` on, in `bits` bits."""
    return math.ceil(bits + GUARD_BITS - math.log2(min(finest, 1.0)))


def _units(state: Sequence[Fraction]) -> Any:
    """The inverses of |M| and of |gamma|, for each of the six components; 1 for a zero vector."""
    M, gamma = (math.hypot(*map(float, part)) or 1.0 for part in (state[:3], state[3:]))
    return np.repeat((1 / M, 1 / gamma), 3)


def summed(series: Array) -> Any:
    """The values (6, n) of series (order + 1, 6, n) at the end of the step, small terms first."""
    return series[::-1].sum(axis=0)


@functools.lru_cache(maxsize=16)
def bilinear(coefficients: AlignedCoefficients) -> Bilinear:
    """The aligned field's L and B, without the products that have no part in any component.

    They are kept, because the orbits of a call share them.
    """
    exactly = AlignedCoefficients(*map(Fraction, coefficients))
    ones = np.eye(SIZE, dtype=int) * Fraction(1)

    def along(state: Any, change: Any) -> Any:
        """L y + 2 B(x, y) for a change y."""
        return np.array(aligned_along(state, change, exactly))

    # B(e_i, e_j) from the derivative at e_i along e_j. Each pair i <= j comes first, then those
    # turned round: B(x, y) sums over both.
    linear = [along(0 * one, one) for one in ones]
    halves = list(combinations_with_replacement(range(SIZE), 2))
    pairs = np.array([*halves, *((j, i) for i, j in halves if i != j)])
    products = np.array([(along(ones[i], ones[j]) - linear[j]) / 2 for i, j in pairs])
    needed = (products != 0).any(axis=1)
    left, right = pairs[needed].T
    return np.array(linear).T.astype(float), left, right, products[needed].T.astype(float)
