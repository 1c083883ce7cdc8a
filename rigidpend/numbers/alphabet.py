"""The symbols of route codes as numbers, for what computes them as well as for what draws them."""

from __future__ import annotations

from typing import Any

import numpy as np

NO_SYMBOL = 255
"""The code where there is no symbol: the orbit does not cross J1 = J2/2 again."""


def words(codes: Any, known: Any) -> list[str]:
    """Codes (n_symbols, n) as texts, one an orbit: ``.`` for no symbol, ``?`` where not known."""
    shown = np.where(codes == NO_SYMBOL, ".", np.asarray(codes).astype("U1"))
    return ["".join(column) for column in np.where(known, shown, "?").T]
