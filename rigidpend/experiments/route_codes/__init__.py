"""Binary route codes over initial phases: Fig. 4."""

from __future__ import annotations

from rigidpend.experiments.compare import ROUNDING
from rigidpend.experiments.data import ANY, FLAG, FLOAT, Field, Layout
from rigidpend.experiments.shared import MEANING

BY_MAP = Field(
    FLAG,
    ("columns",),
    "1",
    "whether return maps found the column; absent: all were integrated",
    within=ANY,
)
ZEROS = Field(FLOAT, ("zeros",), "rad", "zeros of Melnikov's integral in theta2_0", within=ROUNDING)

LAYOUT: Layout = {"<arrays>": {**MEANING, "by_map?": BY_MAP, "melnikov_zeros": ZEROS}}
