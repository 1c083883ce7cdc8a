"""Layout of a result of `route_map`."""

from __future__ import annotations

from rigidpend.experiments.data.layout import (
    FLAG,
    FLOAT,
    TEXT,
    WHOLE,
    Field,
    Layout,
)

PLANE = {
    "codes": Field(
        WHOLE,
        ("symbols", "rows", "columns"),
        "1",
        "symbols, layer 0 = symbol 1: 0 left, 1 right, 255 none (no return)",
    ),
    "certain": Field(
        WHOLE, ("rows", "columns"), "1", "how many of the first symbols are established"
    ),
    "by_map": Field(
        FLAG, ("rows", "columns"), "1", "whether return maps found the cell, not integration"
    ),
    "x": Field(FLOAT, ("columns",), "rad", "theta2_0 of the columns"),
    "y": Field(FLOAT, ("rows",), "see y_axis", "values of the rows"),
}
OTHER_X = Field(FLOAT, ("columns",), "see x_axis", "values of the columns")
"""The field x where the config gives columns."""
KINDS = "theta2_0 (rad), log10_J1_0, mu, h0 (dimensionless), beta0 or alpha0 (rad)"
Y_AXIS = Field(TEXT, (), "", f"what y is: {KINDS}")
COLUMNS = {
    "x_axis": Field(TEXT, (), "", f"what x is: {KINDS}"),
    "marked_x": Field(FLOAT, (), "see x_axis", "the column of the config's own value"),
}
"""Fields that tell of columns that the config gives."""
MARKED = Field(FLOAT, (), "see y_axis", "the row of the config's own value")
FREQUENCY = Field(FLOAT, (), "1", "nu, by which a change of a symbol repeats: exp(pi^2/nu)")

LAYOUT: Layout = {
    **PLANE,
    "y_axis": Y_AXIS,
    "marked": MARKED,
    **{f"{name}?": field for name, field in COLUMNS.items()},
    "nu": FREQUENCY,
    "zooms?": {"<zooms>": PLANE},
}
