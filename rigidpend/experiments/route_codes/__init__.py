"""Binary route codes over initial phases: Fig. 4."""

from rigidpend.experiments.compare import ROUNDING
from rigidpend.experiments.data import ANY, Layout, double, flag
from rigidpend.experiments.shared import MEANING

BY_MAP = flag(
    "1", "whether return maps found the column; absent: all were integrated", "columns", within=ANY
)
ZEROS = double("rad", "zeros of Melnikov's integral in theta2_0", "zeros", within=ROUNDING)

LAYOUT: Layout = {"<arrays>": {**MEANING, "by_map?": BY_MAP, "melnikov_zeros": ZEROS}}
