"""Layout of a result of `exponents`."""

from __future__ import annotations

from rigidpend.experiments.data.layout import (
    FLOAT,
    WHOLE,
    Field,
    Layout,
)

CELLS, LENGTHS, CHECKED_ = ("rows", "columns"), ("symbols",), ("checked",)

PLANE = {
    "codes": Field(
        WHOLE, ("symbols", "rows", "columns"), "1", "symbols: 0 left, 1 right, 255 no return"
    ),
    "exponent": Field(
        FLOAT,
        CELLS,
        "1",
        "ln of the growth of the deviation that grows most through all passages, a passage, on the"
        " section M3 = 0 at the orbit's energy, in the Euclidean norm of (M', gamma), all"
        " dimensionless; NaN where the code is not certain, or return maps do not reach",
        gaps=True,
    ),
    "allowed": Field(
        FLOAT,
        CELLS,
        "1",
        "bound of the exponent's rounding, a power of two; NaN as above",
        gaps=True,
    ),
    "theta2_0": Field(FLOAT, ("columns",), "rad", "initial phases of the columns"),
    "log10_J1_0": Field(FLOAT, ("rows",), "1", "decadic logarithms of the rows' initial actions"),
}
MARKED = Field(FLOAT, (), "1", "log10 of the config's own J1_0")
GROWTH = {
    "passages": Field(WHOLE, LENGTHS, "1", "passages through which deviations have grown"),
    "share": Field(FLOAT, ("shares",), "1", "shares of the cells whose exponents are below"),
    "exponent": Field(
        FLOAT, ("shares", "symbols"), "1", "quantiles of the cells' exponents", gaps=True
    ),
}
CHECKED = {
    "row": Field(WHOLE, CHECKED_, "1", "row of the cell"),
    "column": Field(WHOLE, CHECKED_, "1", "column of the cell"),
    "growth": Field(
        FLOAT, CHECKED_, "1", "ln of the growth through all passages; NaN as above", gaps=True
    ),
    "difference": Field(
        FLOAT, CHECKED_, "1", "that by the variational equations, integrated, less it", gaps=True
    ),
    "allowed": Field(FLOAT, CHECKED_, "1", "bound of the rounding of the growth", gaps=True),
}
LAYOUT: Layout = {
    **PLANE,
    "marked": MARKED,
    "growth": GROWTH,
    "checked": CHECKED,
}
