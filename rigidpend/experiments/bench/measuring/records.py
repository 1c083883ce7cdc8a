"""The data of a measurement: what a worker tells, as arrays with their meaning."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rigidpend.experiments.bench import layout
from rigidpend.experiments.data.layout import Fields
from rigidpend.experiments.data.tree import Tree

COMPLETE = "complete"
Line = dict[str, Any]


def absent(library: str) -> Tree:
    """The record of a method that is not installed."""
    return {"ended": layout.ENDED.dataset(f"absent: {library} is not installed")}


def searched(lines: list[Line], ended: str, problem: str, planned: int) -> Tree:
    """The record of a method at a problem, of what a worker told.

    Parameters
    ----------
    lines : list of dict
        All that it told: first the costs of its import.
    ended : str
        What went wrong with the worker; empty where nothing did.
    problem : str
    planned : int
        How many measurements were asked for.
    """
    own = [line for line in lines[1:] if line["problem"] == problem]
    rows = [line for line in own if "knob" in line]
    wrong = next((line["failed"] for line in own if "failed" in line), ended)
    said = f"{len(rows)} of {planned}"
    cut = f"cut at the budget: {said}" if len(rows) < planned else COMPLETE
    once = {k: v for line in [*lines[:1], *own] for k, v in line.items() if k in layout.ONCE}
    return {
        "ended": layout.ENDED.dataset(f"{wrong}: {said}" if wrong else cut),
        **{
            name: layout.ONCE[name].dataset(value if isinstance(value, str) else float(value))
            for name, value in once.items()
        },
        **arrays(layout.ROWS, rows),
    }


def arrays(fields: Fields, rows: Sequence[Line]) -> Tree:
    """Arrays of those fields that rows have, by their names."""
    return {
        name: field.dataset(np.array([row[name] for row in rows], dtype=float))
        for name, field in fields.items()
        if rows and name in rows[0]
    }


def single(fields: Fields, row: Line) -> Tree:
    """Numbers and lists of those fields that a row has."""
    return {
        name: field.dataset(np.array(row[name], dtype=float))
        for name, field in fields.items()
        if name in row
    }
