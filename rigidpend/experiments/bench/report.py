"""Time, ratios and trust of every method, losses first."""

from __future__ import annotations

from typing import Any

from rigidpend.measure.benchmark import reading
from rigidpend.tables import Table


def tables(result: Any) -> list[Table]:
    """All tables of a loaded result."""
    return reading.tables(result["data"])
