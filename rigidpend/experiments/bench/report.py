"""Time, ratios and trust of every method, losses first."""

from __future__ import annotations

from rigidpend.experiments.bench.measuring import reading
from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Of two methods the one further down on the left is faster at less error. Every method is"
    " used as its own documentation does, on one machine."
)


def tables(result: Loaded) -> list[Table]:
    """All tables of a loaded result."""
    return reading.tables(result["data"])
