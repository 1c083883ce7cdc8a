"""Layout of a result of `route_codes`."""

from __future__ import annotations

from rigidpend.experiments.route_layout import MEANING
from rigidpend.results.layout import FLOAT, Field, Layout

ZEROS = Field(FLOAT, ("zeros",), "rad", "zeros of Melnikov's integral in theta2_0")

LAYOUT: Layout = {"<arrays>": {**MEANING, "melnikov_zeros": ZEROS}}
