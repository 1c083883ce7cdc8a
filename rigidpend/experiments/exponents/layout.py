"""Layout of a result of `exponents`."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.experiments.data.bounds import ROUNDING, bound, of_largest, stated, where
from rigidpend.experiments.data.layout import FLOAT, WHOLE, Field, Layout
from rigidpend.experiments.data.tree import Data

LOST = 1e-3
"""Allowed share of cells that are known in one of two results alone, where doubles round otherwise.

As many may move a quantile by the distance of neighbours: `QUANTILE`."""
QUANTILE = 1e-3


def _both(stored: Data, fresh: Data, name: str) -> Any:
    return np.isfinite(stored[name]) & np.isfinite(fresh[name])


# Symbols are the same where the exponent of both is known.
_KNOWN = where(lambda stored, fresh: _both(stored, fresh, "exponent"))


@bound
def _rounded(name: str, stored: Data, fresh: Data) -> Any:
    """Exponents differ by the stored bound of their rounding where both are known."""
    both = _both(stored, fresh, "exponent")
    lost = np.isfinite(stored["exponent"]) & ~both
    # Hardly any is known no more: else all these are told.
    held = both | lost if lost.mean() > LOST else both
    return np.where(held, stored["allowed"], np.inf)


def _grown(stored: Data, fresh: Data) -> Any:
    """The stored bound of the growth's rounding, where both are known."""
    return np.where(_both(stored, fresh, "growth"), stored["allowed"], np.inf)


OF_GROWTH = bound(lambda name, stored, fresh: _grown(stored, fresh))

CELLS, LENGTHS, CHECKED_ = ("rows", "columns"), ("symbols",), ("checked",)

PLANE = {
    "codes": Field(
        WHOLE,
        ("symbols", "rows", "columns"),
        "1",
        "symbols: 0 left, 1 right, 255 no return",
        within=_KNOWN,
    ),
    "exponent": Field(
        FLOAT,
        CELLS,
        "1",
        "ln of the growth of the deviation that grows most through all passages, a passage, on the"
        " section M3 = 0 at the orbit's energy, in the Euclidean norm of (M', gamma), all"
        " dimensionless; NaN where the code is not certain, or return maps do not reach",
        gaps=True,
        within=_rounded,
    ),
    "allowed": Field(
        FLOAT,
        CELLS,
        "1",
        "bound of the exponent's rounding, a power of two; NaN as above",
        gaps=True,
        within=_rounded,
    ),
    "theta2_0": Field(
        FLOAT,
        ("columns",),
        "rad",
        "initial phases of the columns",
        within=of_largest(ROUNDING),
        symbol=r"$\theta_2^0$",
        coordinate=True,
    ),
    "log10_J1_0": Field(
        FLOAT,
        ("rows",),
        "1",
        "decadic logarithms of the rows' initial actions",
        within=of_largest(ROUNDING),
        symbol=r"$\log_{10} J_1^0$",
    ),
}
MARKED = Field(FLOAT, (), "1", "log10 of the config's own J1_0", within=of_largest(ROUNDING))
GROWTH = {
    "passages": Field(WHOLE, LENGTHS, "1", "passages through which deviations have grown"),
    "share": Field(FLOAT, ("shares",), "1", "shares of the cells whose exponents are below"),
    "exponent": Field(
        FLOAT,
        ("shares", "symbols"),
        "1",
        "quantiles of the cells' exponents",
        gaps=True,
        within=QUANTILE,
    ),
}
CHECKED = {
    "row": Field(WHOLE, CHECKED_, "1", "row of the cell"),
    "column": Field(WHOLE, CHECKED_, "1", "column of the cell"),
    "growth": Field(
        FLOAT,
        CHECKED_,
        "1",
        "ln of the growth through all passages; NaN as above",
        gaps=True,
        within=OF_GROWTH,
    ),
    # What it is off from the variational equations is within as much.
    "difference": Field(
        FLOAT,
        CHECKED_,
        "1",
        "that by the variational equations, integrated, less it",
        gaps=True,
        within=stated(_grown),
    ),
    "allowed": Field(
        FLOAT, CHECKED_, "1", "bound of the rounding of both growths", gaps=True, within=OF_GROWTH
    ),
}
LAYOUT: Layout = {**PLANE, "marked": MARKED, "growth": GROWTH, "checked": CHECKED}
