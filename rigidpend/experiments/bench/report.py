"""How long each method takes to reach an error, beside the one that is picked by default."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from rigidpend.measure.benchmark.methods import METHODS
from rigidpend.measure.benchmark.tables import LEVELS, all_right, time_to_reach
from rigidpend.report.page import Table


def tables(result: Any) -> list[Table]:
    """A table a problem, from a loaded result."""
    problems = {name: group for name, group in result["data"].items() if "default" in group}
    return [_table(name, group) for name, group in problems.items()]


def _table(name: str, group: Any) -> Table:
    default = str(group["default"])
    further = ("all symbols right",) if name == "codes" else ()
    header = ("method", *(f"{level:.0e}" for level in LEVELS), *further)
    rows = [
        (METHODS[method].label + (" *" if method == default else ""), *_cells(name, group, method))
        for method in group
        if method in METHODS
    ]
    caption = f"{group['title']}: time to reach an error (times that of the default *)"
    return Table(caption, header, rows, f"Error: {group['error']}.")


def _cells(name: str, group: Any, method: str) -> Iterator[str]:
    record, default = group[method], group.get(str(group["default"]), {})
    for level in LEVELS:
        yield _cell(time_to_reach(record, level), time_to_reach(default, level))
    if name == "codes":
        yield _cell(all_right(record).seconds, all_right(default).seconds)


def _cell(seconds: float, default: float) -> str:
    if not math.isfinite(seconds):
        return "not reached"
    shown = f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"
    return f"{shown} ({seconds / default:.2g})" if math.isfinite(default) else shown
