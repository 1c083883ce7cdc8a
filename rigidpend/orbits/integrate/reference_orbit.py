"""Reference orbits: one orbit in high precision, step by step, for others to be followed beside it.

A neighbour at a distance d needs of the reference no more bits than tell the two apart, with
those of d itself. As d grows, fewer and fewer suffice: the precision falls with the tangent, the
derivative of the orbit along the family of its neighbours. So it is for a single orbit in many
bits: what rounding has done to it has grown as much.

Differences from it are found without cancellation. The field is quadratic, f(x) = L x + B(x, x)
with B symmetric. So the difference d = x - X of an orbit x from a reference orbit X obeys

    d' = L d + B(d, 2 X + d),

where nothing cancels however small d is: it keeps its relative precision, and the reference
needs no more digits than d has. L and B are read off :func:`rigidpend.mechanics.equations.aligned`
itself.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations_with_replacement, islice
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients, aligned_along
from rigidpend.numbers.exact import GUARD_BITS
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate import Crossings, Orbits, in_turn, no_crossings, silent_outcome
from rigidpend.orbits.integrate.arithmetic import PAIRS, in_kernel, rung
from rigidpend.orbits.integrate.batch import advance, written
from rigidpend.orbits.integrate.passages import TOUCH, UNDECIDED, crossings_of_series, touch
from rigidpend.orbits.records import joined

BLOCK = 8
"""Steps at a time, all in one precision."""
PARTS = 3
"""Parts of a step in integers: they are longer than tangents in doubles are carried at once."""
MAX_STEPS = 10_000_000
"""Steps after which an orbit counts as failed: some 300,000 passages."""
TINY = 2.0**-800
"""Size of the differences that stand for a tangent: their squares vanish beside them."""
SIZE = 6
"""Number of aligned components."""
MORE_TERMS = 4
"""Terms of a difference's series beyond those that the reference's own would need."""


class Point(NamedTuple):
    """End of a step of a reference orbit."""

    exact_time: Fraction
    """t' since the start."""
    state: tuple[Fraction, ...]
    """The six aligned components."""
    time: float
    step: float
    """Length t' of the step that ends here."""
    doubles: Array
    """The components rounded."""


Passed: TypeAlias = tuple[float, int]
"""A crossing of M3 = 0: t' since the start, and the separatrix.

The time of a reference orbit is the nearest double, but for a rare last bit."""
Bilinear: TypeAlias = tuple[Array, Any, Any, Array]
"""L (6, 6), the pairs i and j of components that B multiplies, and B of these in columns."""


def crossings(orbits: Orbits, bits: int, engine: str, tolerance: float) -> Crossings:
    """Crossings of orbits in `bits` bits at first, one by one, in a precision that falls.

    The tangent that tells how it falls is as large in M and in gamma, so that it has its share in
    whatever grows; roundings stay below by `GUARD_BITS`. `bits` are relative to the smallest
    initial component.
    """
    found = []
    for state in orbits.states.T:
        orbit = ReferenceOrbit(
            orbits.coefficients,
            state,
            [Fraction(1 / x) for x in _units(state)],
            longest=orbits.passage_limit,
            engine=engine,
            bits=bits + GUARD_BITS,
            tolerance=tolerance,
        )
        found.append(orbit.followed(orbits.n_crossings))
    return joined(found)


class ReferenceOrbit:
    """An orbit in high precision, continued as far as it is asked for.

    State and coefficients are Fractions, and so is the tangent, the derivative of the state at time
    0 along the family of neighbours, which is carried in doubles. `bits` are the precision at time
    0, the computation's own is a `rung` from pairs of doubles on; integers serve where the engine's
    numbers end.
    After a wait of `longest` for the next crossing, t', the orbit is not continued. `tolerance` is
    that of a compiled Taylor series in 53 bits; every bit more halves it.
    """

    def __init__(
        self,
        coefficients: AlignedCoefficients,
        state: Sequence[Fraction],
        tangent: Sequence[Fraction],
        *,
        longest: float,
        engine: str,
        bits: int,
        tolerance: float,
    ) -> None:
        self.coefficients, self.longest = coefficients, longest
        self.engine, self.bits, self.tolerance = engine, bits, tolerance
        self.points = [Point(Fraction(0), tuple(state), 0.0, 0.0, np.array(state, dtype=float))]
        """As far as the orbit is known; the first is the start."""
        self.crossings: list[list[Passed]] = []
        """The crossings on each step."""
        self._field = bilinear(coefficients)
        self._units = _units(state)
        self._last = 0.0
        self.tangents = [np.array(tangent, dtype=float)]
        self.growth = [float(self.size(self.tangents[0][:, None])[0])]
        """The size of the tangent at each point."""

    def reaches(self, k: int) -> bool:
        """Continue the orbit to point k; False if it has long had no crossing before that."""
        while k >= len(self.points):
            if self.points[-1].time - self._last > self.longest:
                return False
            self._extend()
        return True

    def series(self, k: int, differences: Array, tolerance: float) -> Array:
        """Series (order + 1, 6, 1 + n) of the orbit and of others on the step from point k.

        Column 0 is the orbit's own, the others are those of the `differences` (6, n); in doubles
        and in powers of the share of the step.
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
            # The reference itself is a difference from the orbit that stays at zero.
            total[:, 0] = now[:, 0]
            now.take(left_of, axis=0, out=left[j], mode="clip")
            total.take(right_of, axis=0, out=right[j], mode="clip")
            products = np.einsum("kpn,kpn->pn", left[: j + 1], right[j::-1])
            terms[j + 1] = (linear @ now + weights @ products) / (j + 1)
        return terms * (self.points[k + 1].step ** np.arange(order + 1))[:, None, None]

    def size(self, differences: Any) -> Any:
        """The sizes of differences (6, n), relative to |M| and to |gamma|."""
        return (np.abs(differences) * self._units[:, None]).max(axis=0)

    def last_below(self, size: float) -> int:
        """The last point up to which the tangent has always been smaller than `size`, or 0."""
        k = 0
        while self.reaches(k + 1) and self.growth[k + 1] < size:
            k += 1
        return k

    def followed(self, n_crossings: int) -> Crossings:
        """The first crossings; FAILED where they do not rise and sink in turn."""
        found, rows = no_crossings(n_crossings, 1), list[Any]()
        for k in range(MAX_STEPS):
            if not self.reaches(k + 1):
                found.outcome[0] = silent_outcome(*self.points[-1].state[:2])
                break
            rows += [(0, *passed) for passed in self.crossings[k]]
            if len(rows) >= n_crossings or (rows and rows[-1][2] == UNDECIDED):
                break
        written(np.reshape(rows, (-1, 3)).T, found, self.longest)
        return in_turn(found)

    def bits_at(self, k: int) -> float:
        """Bits that are left at a known point."""
        return self.bits - math.log2(max(self.growth[: k + 1]) / self.growth[0])

    def _extend(self) -> None:
        """Take some further steps."""
        first = len(self.points) - 1
        begin = self.points[first]
        for time, state in self.advanced(begin.state, rung(max(PAIRS, self.bits_at(first)))):
            last, here = self.points[-1].exact_time, begin.exact_time + time
            doubles = np.array(state, dtype=float)
            self.points.append(Point(here, state, float(here), float(here - last), doubles))
        for k in range(first, len(self.points) - 1):
            self._carry_tangent(k)

    def advanced(self, state: Sequence[Fraction], bits: int) -> Any:
        """Times and states at the ends of some further steps."""
        if in_kernel(self.engine, bits):
            return advance(self.coefficients, state, BLOCK, bits, self.tolerance)
        from rigidpend.orbits.integrate import bigint

        taken = islice(bigint.steps(self.coefficients, state, bits), BLOCK)
        return [(step.time(at), step.at(at)) for step in taken for at in step.parts(PARTS)]

    def _carry_tangent(self, k: int) -> None:
        """Carry the tangent over step k, and note what the orbit crosses there."""
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
        """The crossings on step k as the bits that are left decide them."""
        from rigidpend.orbits.integrate import bigint

        bits = math.ceil(self.bits_at(k))
        step = next(bigint.steps(self.coefficients, self.points[k].state, bits))
        length = step.since_begin(self.points[k + 1].exact_time - self.points[k].exact_time)
        return list(step.crossings(length, touch(bits - GUARD_BITS)))


def reference_bits(finest: float, bits: int) -> int:
    """Bits of a reference orbit for neighbours in `bits` bits, at distances from `finest` on."""
    return math.ceil(bits + GUARD_BITS - math.log2(min(finest, 1.0)))


def _units(state: Sequence[Fraction]) -> Any:
    """The inverse sizes of M and of gamma, for each component; of nothing 1."""
    M, gamma = (math.hypot(*map(float, part)) or 1.0 for part in (state[:3], state[3:]))
    return np.repeat((1 / M, 1 / gamma), 3)


def summed(series: Array) -> Any:
    """The values (6, n) of such series at the end of the step, small terms first."""
    return series[::-1].sum(axis=0)


@functools.lru_cache(maxsize=16)
def bilinear(coefficients: AlignedCoefficients) -> Bilinear:
    """The aligned field's L and B: kept, for orbits of a call share theirs.

    Of B what adds nothing to any of the six components is left out.
    """
    exactly = AlignedCoefficients(*map(Fraction, coefficients))
    ones = np.eye(SIZE, dtype=int) * Fraction(1)

    def along(state: Any, change: Any) -> Any:
        """L y + 2 B(x, y) for a change y."""
        return np.array(aligned_along(state, change, exactly))

    linear = [along(0 * one, one) for one in ones]
    halves = list(combinations_with_replacement(range(SIZE), 2))
    pairs = np.array([*halves, *((j, i) for i, j in halves if i != j)])
    products = np.array([(along(ones[i], ones[j]) - linear[j]) / 2 for i, j in pairs])
    needed = (products != 0).any(axis=1)
    left, right = pairs[needed].T
    return np.array(linear).T.astype(float), left, right, products[needed].T.astype(float)
