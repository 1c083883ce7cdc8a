"""Check of the content of a result file, before it is used: its config, its numbers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from rigidpend import experiments
from rigidpend.experiments.data import FLOAT, NUMBER, Layout, Loaded, fields
from rigidpend.results.structure import Unfit

LONGEST, DEEPEST = 2**22, 32
"""Characters of a config, and its brackets inside each other, at most."""


def check(loaded: Loaded, layout: Layout | None = None) -> None:
    """Check the values of a loaded result, of its experiment's layout or the one given.

    Raises
    ------
    Unfit
        A number is not finite that must be.
    """
    layout = layout or experiments.layout(loaded["attributes"]["experiment"])
    for place, values, field in fields(layout, loaded["data"]):
        if field.kind in (FLOAT, NUMBER) and not (field.gaps or np.isfinite(values).all()):
            raise Unfit(f"data/{place} has a number that is not finite")


def config(text: str) -> dict[str, Any]:
    """Read the config of a result.

    Raises
    ------
    Unfit
        It is no JSON object, or too long or too deep for a config.
    """
    try:
        found = json.loads(text) if len(text) <= LONGEST else None
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise Unfit("its config is no JSON object")
    if _depth(found) > DEEPEST:
        raise Unfit(f"its config has more than {DEEPEST} brackets inside each other")
    return found


def _depth(node: Any) -> int:
    """Count the brackets inside each other; none is entered that is too deep."""
    # Level by level: recursion could be exhausted by a file made for that.
    level, depth = [node], 0
    while level and depth <= DEEPEST:
        inner = [x.values() if isinstance(x, dict) else x for x in level if _is_bracket(x)]
        level = [x for each in inner for x in each]
        depth += 1
    return depth


def _is_bracket(node: Any) -> bool:
    return isinstance(node, dict | list)
