"""Time, ratios and trust of every method, losses first."""

from __future__ import annotations

from rigidpend.experiments.bench.measuring import reading
from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Table

CAPTION = "Run time against error, every method used as its own documentation does, on one machine."


def tables(result: Loaded) -> list[Table]:
    """All tables of a loaded result."""
    return reading.tables(result["data"])
