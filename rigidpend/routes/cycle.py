"""The heteroclinic cycle of Fig. 2: vertices, separatrices and the symbols of a route."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidpend.numbers.expressions import NO_SYMBOL

TURNS = (
    *((2, 1, 0), (2, 3, 1), (4, 3, 0), (4, 1, 1)),
    *((1, 4, 0), (1, 2, 1), (3, 2, 0), (3, 4, 1)),
)
"""Turns of an orbit near a periodic orbit: separatrix of arrival, separatrix of departure, symbol.

With symbol 0 the orbit leaves towards smaller theta1 (left), with 1 towards larger theta1 (right),
modulo 4 pi."""

MIRRORED = np.array([0, 3, 4, 1, 2], dtype=np.uint8)
"""Separatrices of the mirror image of an orbit: 1 and 3, 2 and 4 change places; 0 is none."""

# Indexed by arrival and departure. Pairs that are no turn, and 0 for no crossing, have no symbol.
_SYMBOL = np.full((5, 5), NO_SYMBOL, dtype=np.uint8)
for _arriving, _leaving, _symbol in TURNS:
    _SYMBOL[_arriving, _leaving] = _symbol


def symbols(separatrix: ArrayLike) -> NDArray[np.uint8]:
    """The symbols (k, n) of crossings (k + 1, n), given by separatrices 1..4, or 0 for no crossing.

    Symbol i is the side on which the orbit leaves between crossings i and i + 1; `NO_SYMBOL` where
    there is no crossing i + 1.
    """
    beside = np.asarray(separatrix)
    # One index for both separatrices, 5 i + j: 1.5 million pairs take 1.6 ms instead of 5.
    return np.take(_SYMBOL, beside[:-1] * np.uint8(len(_SYMBOL)) + beside[1:])
