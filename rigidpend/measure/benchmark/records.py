"""The data of a measurement: what a worker tells, as arrays with their meaning."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.results.tree import Dataset, Tree

MEANING = {
    "knob": ("1", "tolerance, or steps in a period; NaN where there is none"),
    "error": ("1", "of the answer, as the problem defines it"),
    "worst": ("t' = t s", "largest error of a crossing time, over all columns"),
    "wrong": ("1", "share of wrong symbols"),
    "wrong_symbols": ("1", "number of wrong symbols"),
    "energy": ("1", "largest drift of the energy, relative"),
    "gamma": ("1", "largest drift of |gamma|, relative"),
    "area": ("1", "largest drift of M . gamma, in |M|"),
    "reach": ("period", "how far the orbits were followed"),
    "asked": ("period", "how far they were to be followed"),
    "columns": ("1", "number of orbits"),
    "n_symbols": ("1", "symbols on each orbit"),
    "seconds": ("s", "warm, one core: the median"),
    "fastest": ("s", "the fastest repetition"),
    "slowest": ("s", "the slowest repetition"),
    "repeats": ("1", "how many repetitions the median is of"),
    "prepare": ("s", "made ready and solved first, beyond a warm solve: compilation, mostly"),
    "memory": ("MB", "peak of the process so far"),
}
ONCE = {
    "import": ("s", "time to import its libraries, NumPy apart"),
    "memory_before": ("MB", "peak of the process before that import"),
}
ENDED = Dataset(
    "", "text", "how the measurement ended: complete, cut at the budget, absent, failed"
)
COMPLETE = "complete"


def absent(library: str) -> Tree:
    """The record of a method that is not installed."""
    return {"ended": ENDED._replace(values=f"absent: {library} is not installed")}


def record(lines: list[dict[str, Any]], ended: str, planned: int) -> Tree:
    """The record of a worker's lines.

    Parameters
    ----------
    lines : list of dict
        What it told: first what is told once, then the measurements.
    ended : str
        What went wrong; empty where nothing did.
    planned : int
        How many measurements were asked for.
    """
    once, rows = lines[:1], lines[1:]
    cut = f"cut at the budget: {len(rows)} of {planned}" if len(rows) < planned else COMPLETE
    said = f"{ended}: {len(rows)} of {planned}" if ended else cut
    found: dict[str, Dataset] = {"ended": ENDED._replace(values=said)}
    for told in once:
        found |= {name: Dataset(float(told[name]), *meaning) for name, meaning in ONCE.items()}
    for name, meaning in MEANING.items():
        if rows and name in rows[0]:
            found[name] = Dataset(np.array([float(row[name]) for row in rows]), *meaning)
    return found
