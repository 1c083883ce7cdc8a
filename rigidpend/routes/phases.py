"""Initial phases: doubles with their rests for double precision, exact numbers on demand.

A phase far from zero loses its whole turns before it is rounded. Otherwise its rounding error would
be no small angle, and would be the same in all computations, which could not show it.
"""

import functools
import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers.checked import MOST_PHASES
from rigidpend.numbers.exact import Exact, ExactError, context, exact

FAR = 2.0**20
"""Size of a phase, radians, from which on it is computed without its whole turns."""
DOUBLED = 113
"""Bits in which a phase is computed before it becomes a double and its rest."""


class Grid(Sequence[Exact]):
    """The phases start + k step, k = 0 .. count - 1, exact, each made when it is asked for."""

    def __init__(self, start: Exact, step: Exact, count: int) -> None:
        self.start, self.step, self._length = start, step, count

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, k: Any) -> Any:
        if not 0 <= k < self._length:
            raise IndexError(k)
        return self.start + self.step * k


class Phases:
    """A sequence of phases in radians; ExactError is raised where one is not a finite number."""

    high: NDArray[np.float64]
    """The doubles nearest to the phases, (n,)."""
    near: NDArray[np.float64]
    """The same doubles, (n,), but without whole turns where a phase is far from zero."""
    rest: NDArray[np.float64]
    """The phases less `near` and whole turns, (n,), rounded to doubles."""

    def __init__(self, values: Any) -> None:
        self._given: Any
        if isinstance(values, Iterator):
            # An iterator gives its values only once, and may have no end.
            values = list(islice(values, MOST_PHASES + 1))
        # A range costs nothing at any length, but each of its numbers would be made here.
        if isinstance(values, Sequence) and len(values) > MOST_PHASES:
            raise ExactError(f"theta2_0 has {len(values)} phases; {MOST_PHASES} are the most")
        # Labelled arrays, such as those of a loaded result, and tables' columns.
        if hasattr(values, "__array__") and not isinstance(values, np.ndarray):
            values = np.asarray(values)
        # Asking for `mask` first spares all others the import of np.ma, which NumPy does on demand.
        if isinstance(values, np.ndarray) and hasattr(values, "mask"):
            if np.ma.is_masked(values):
                raise ExactError("theta2_0 has masked values; give those that are to be computed")
            values = values.data
        if isinstance(values, np.ndarray) and values.dtype == np.float64:
            # Doubles are exact as they are: no object is made for each of many phases.
            self._given = self.high = np.atleast_1d(values).copy()
            self.rest = np.zeros(values.size)
        else:
            self._given = values if _is_sequence(values) else [values]
            try:
                halves = [_halves(exact(x)) for x in self._given]
            except ExactError as error:
                raise ExactError(f"theta2_0: {error}") from None
            self.high, self.rest = np.array(halves, dtype=float).reshape(-1, 2).T
        if self.high.ndim > 1:
            raise ExactError(f"theta2_0 must be a list of numbers, got {self.high.ndim} dimensions")
        if not np.isfinite(self.high).all():
            bad = self.high[~np.isfinite(self.high)][0]
            raise ExactError(f"theta2_0 must be finite doubles, got {bad}")
        self.near, far = self.high, np.flatnonzero(np.abs(self.high) >= FAR)
        if far.size:
            self.near, within = self.high.copy(), (angle(x, DOUBLED) for x in self.exactly(far))
            self.near[far], self.rest[far] = zip(*map(_parted, within), strict=True)

    def __len__(self) -> int:
        return self.high.size

    def exactly(self, columns: Iterable[int]) -> list[Exact]:
        """The phases of some columns, exact, whole turns included."""
        return [exact(self._given[k]) for k in columns]


def _is_sequence(values: Any) -> bool:
    """True for a list, another sequence or an array, but not for text or a single number."""
    # np.ndim would raise an error for a list whose parts differ in length.
    listed = isinstance(values, Sequence) and not isinstance(values, str | bytes)
    return listed or getattr(values, "ndim", 0) > 0


# Kept, because all cells of a plane may have one phase.
@functools.lru_cache(maxsize=256)
def _halves(x: Exact) -> tuple[float, float]:
    """The double nearest to x, and the double nearest to the difference."""
    if x.fraction is not None:
        nearest = float(x)
        # Infinity, where a fraction is beyond doubles, is refused by the caller.
        rest = x.fraction - Fraction(nearest) if math.isfinite(nearest) else Fraction(0)
        return nearest, float(rest)
    # More than twice the bits of a double, so that the rest has digits of its own.
    return _parted(x.at(DOUBLED))


def _parted(value: Any) -> tuple[float, float]:
    """The double nearest to an mpmath number, and the double nearest to the difference."""
    nearest = float(value)
    return nearest, float(value - nearest)


def angle(phase: Exact, bits: int) -> Any:
    """A phase in `bits` bits, radians; without its whole turns where it is far from zero."""
    size = abs(float(phase))
    if size < FAR:
        return phase.at(bits)
    # As many bits more as the whole turns cancel.
    m = context(bits + math.frexp(size)[1])
    value, turn = phase.at(m.prec), 2 * m.pi
    return context(bits).mpf(value - turn * m.nint(value / turn))


def turned(cos: Any, sin: Any, rest: Any) -> tuple[Any, Any]:
    """cos and sin of an angle that is larger by `rest`, radians, below 2^-32 in size."""
    # Taylor's series to second order: the third order, below 2^-98, is less than a rounding in any
    # precision that is used with rests.
    bend = rest * rest / 2
    return cos - (rest * sin + bend * cos), sin + (rest * cos - bend * sin)
