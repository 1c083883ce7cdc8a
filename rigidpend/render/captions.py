"""Captions: what one sees in a figure, and the body and the start of a result in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rigidpend import experiments
from rigidpend.experiments.data import Loaded
from rigidpend.numbers.expressions import as_written

SHARED = ("beta0", "mu", "h", "h0", "half_turns", "M_0", "J1_0", "theta2_0")
"""Keys of a problem that are told beside the body, in this order, if one value is given."""
LONGEST = 300
"""Characters of a value that are shown."""


def caption(experiment: str) -> str:
    """Sentences on what the figures of an experiment show: the first is for whoever sees one."""
    return str(getattr(experiments.drawing(experiment), "CAPTION", ""))


def foot(result: Loaded) -> list[str]:
    """The lines at the foot of a figure: what one sees, then the name and the body."""
    attributes = result["attributes"]
    seen, stop, _ = caption(str(attributes["experiment"])).partition(". ")
    name, said = str(attributes.get("name", "unnamed")), "; ".join(bodies(result))
    return [*filter(None, [seen + stop.strip()]), f"{name}: {said}" if said else name]


def bodies(result: Loaded) -> list[str]:
    """Describe the body of a result, or each of its bodies, with what they have in common.

    Phrases are such as ``A = (2, 1, 1.5), r along (1, 1, 0), mu = 0.001``; of no body none.
    """
    problem = result["config"].get("problem", {})
    if not isinstance(problem, Mapping):
        return []
    given = {key: problem.get(key) for key in SHARED}
    shared = [
        f"{key} = {_shown(value)}"
        for key, value in given.items()
        # Cells of an axis are shown by the figure itself.
        if value is not None and not isinstance(value, Mapping)
    ]
    # A config's word gamma0 is stored as null.
    if "beta0" in problem and problem["beta0"] is None:
        shared.insert(0, "beta0 = gamma0")
    own = list(_body(problem))
    if own:
        return [", ".join(own + shared)]
    several = problem.get("bodies", {})
    if not isinstance(several, Mapping) or not several:
        return []
    named = (f"{name}: {', '.join(_body(one))}" for name, one in several.items())
    return [", ".join(shared), *named]


def _body(given: Any) -> Iterator[str]:
    """Moments and direction, whichever are given."""
    if isinstance(given, list):
        yield f"A = {_shown(given)}"
    elif isinstance(given, Mapping):
        if "A" in given:
            yield f"A = {_shown(given['A'])}"
        if "r" in given:
            yield f"r along {_shown(given['r'])}"


def _shown(value: Any) -> str:
    """A number as it would be written, a list in brackets; of a long list its ends."""
    if isinstance(value, list):
        if len(value) > 3:
            return f"{_shown(value[0])} to {_shown(value[-1])} ({len(value)} values)"
        return f"({', '.join(map(_shown, value))})"
    return as_written(str(value))[:LONGEST]
