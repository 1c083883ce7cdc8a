"""Captions: what a figure shows, and the body and start of a result in words."""

from collections.abc import Iterator, Mapping
from typing import Any

from rigidpend import experiments
from rigidpend.experiments.data import Loaded
from rigidpend.numbers.texts import as_written

SHARED = ("beta0", "mu", "h", "around", "h0", "half_turns", "approach", "M_0", "J1_0", "theta2_0")
"""Keys of a problem that follow the body, in this order, if they have a single value."""
LONGEST = 300
"""Largest number of characters of a value that are shown."""


def caption(experiment: str) -> str:
    """Sentences on what the figures of an experiment show; the first describes the picture."""
    return str(experiments.drawing(experiment).CAPTION)


def foot(result: Loaded) -> list[str]:
    """The lines at the foot of a figure: what it shows, then the name and the body."""
    attributes = result["attributes"]
    seen, stop, _ = caption(str(attributes["experiment"])).partition(". ")
    name, said = str(attributes.get("name", "unnamed")), "; ".join(bodies(result))
    return [seen + stop.strip(), f"{name}: {said}" if said else name]


def bodies(result: Loaded) -> list[str]:
    """Describe each body of a result, with the parameters common to all.

    Phrases are such as ``A = (2, 1, 1.5), r along (1, 1, 0), mu = 0.001``; an empty list if the
    result has no body.
    """
    problem = result["config"].get("problem", {})
    if not isinstance(problem, Mapping):
        return []
    given = {key: problem.get(key) for key in SHARED}
    shared = [
        f"{key} = {_shown(value)}"
        for key, value in given.items()
        # A mapping is an axis with cells, which the figure itself shows; an interval of energies
        # of no width is one energy.
        if value is not None and not isinstance(value, Mapping) and (key, value) != ("around", "0")
    ]
    # The word gamma0 of a config is stored as null.
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
    """Phrases on moments and direction, as far as they are given."""
    if isinstance(given, list):
        yield f"A = {_shown(given)}"
    elif isinstance(given, Mapping):
        if "A" in given:
            yield f"A = {_shown(given['A'])}"
        if "r" in given:
            yield f"r along {_shown(given['r'])}"


def _shown(value: Any) -> str:
    """A number as it is written, or a list in brackets, shortened to its ends if long."""
    if isinstance(value, list):
        if len(value) > 3:
            return f"{_shown(value[0])} to {_shown(value[-1])} ({len(value)} values)"
        return f"({', '.join(map(_shown, value))})"
    return as_written(str(value))[:LONGEST]
