"""Initial phases: doubles with their rests for the fast precision, exact ones on demand."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.exact import Exact, ExactError, exact, exacts


class Phases:
    """A sequence of phases in radians.

    Attributes
    ----------
    high, rest : (n,) arrays
        The doubles nearest to the phases, and what they leave.

    Raises
    ------
    ExactError
        A phase is not a finite number.
    """

    high: NDArray[np.float64]
    rest: NDArray[np.float64]

    def __init__(self, values: Any) -> None:
        self._given: Any
        if isinstance(values, np.ndarray) and values.dtype == np.float64:
            # An array of doubles is exact as it is: no object for each of many phases.
            self._given = self.high = values.ravel()
            self.rest = np.zeros(values.size)
            if not np.isfinite(values).all():
                raise ExactError(f"theta2_0 must be finite, got {values[~np.isfinite(values)][0]}")
        else:
            given = exacts(values if _is_sequence(values) else [values])
            self._given = given
            self.high = np.array([float(x) for x in given])
            self.rest = np.array([_rest(x) for x in given])

    def __len__(self) -> int:
        return self.high.size

    def exactly(self, columns: Iterable[int]) -> list[Exact]:
        """The phases of some columns, exact."""
        return [exact(self._given[k]) for k in columns]


def _is_sequence(values: Any) -> bool:
    return not isinstance(values, str) and hasattr(values, "__len__") and np.ndim(values) > 0


def _rest(x: Exact) -> float:
    """x minus the double nearest to it."""
    if x.fraction is not None:
        return float(x - exact(float(x)))
    return float(x.at(113) - float(x))
