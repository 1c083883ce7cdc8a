"""Fields that series over the weight share, in `precession` and `splitting`."""

from __future__ import annotations

from rigidpend.experiments.data.bounds import relative
from rigidpend.experiments.data.layout import FLOAT, TEXT, Field

BODIES, EACH = ("bodies",), ("bodies", "mu")
"""Dimensions of what each body has, and of what it has at each weight."""

NAME = Field(TEXT, BODIES, "text", "(bodies,): as in the config")
RATIO = 1e-13
"""Allowed relative difference of a quotient."""
MU_OVER_H0 = Field(FLOAT, ("mu",), "1", "weight over energy", within=relative(RATIO))
