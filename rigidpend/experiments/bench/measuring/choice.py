"""Choice of settings: the knobs a method is tried with, and the setting it is timed with."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring import methods
from rigidpend.experiments.bench.measuring.methods import METHODS, Method
from rigidpend.experiments.data.tree import Data

LEVELS = {
    "free_body": 1e-9,
    "pendulum": 1e-9,
    "precession_angle": 1e-6,
    "long_time": 1e-9,
}
"""The error at which methods meet; at the codes every symbol is right."""


def knobs(method: Method, search: Any, long: bool) -> list[Any]:
    """Knobs that a method is tried with, loosest first."""
    if method.knob == "none":
        return [None]
    if method.knob == "steps":
        return list(search.long_steps if long else search.steps)
    tolerances = search.long_tolerances if long else search.tolerances
    return [float(x) for x in tolerances if float(x) >= method.finest]


def finest(method: Method, search: Any) -> dict[str, Any]:
    """The finest knob and the first setting, for the random phases."""
    return {"knob": knobs(method, search, False)[-1], "setting": method.variants[0]}


def guests(problem: str, group: Data, config: Any, threads: int) -> dict[str, dict[str, Any]]:
    """The methods that meet at a problem, each with knob, setting and part of the way.

    Each comes with the fastest of its settings that reached the level of the problem, or with
    its most exact one where none did. Who is too slow or gains nothing from threads stays away.

    Parameters
    ----------
    problem : str
    group : dict of dict
        By method: its record of the search, arrays.
    config : rigidpend.experiments.bench.schema.Config
    threads : int
    """
    found = {}
    for name in (name for name in config.problem.methods if "seconds" in group.get(name, {})):
        method, record = METHODS[name], group[name]
        k = chosen(problem, record)
        if (threads > 1 and not method.threads) or record["once"][k] > float(
            config.meeting.slowest
        ):
            continue
        found[name] = {**setting(method, record, k), "part": float(record["part"][k])}
    return found


def best(problem: str, name: str, group: Data, search: Any) -> dict[str, Any]:
    """Knob and setting of a method: those that its search at a problem chose, or the finest."""
    method, record = METHODS[name], group.get(name, {})
    if "seconds" in record:
        return setting(method, record, chosen(problem, record))
    return finest(method, search)


def setting(method: Method, record: Data, k: int) -> dict[str, Any]:
    """Knob and setting of a row of a method's search."""
    knob, variant = record["knob"][k], method.variants[int(record["setting"][k])]
    return {
        "knob": None if np.isnan(knob) else float(knob),
        "setting": {**method.forms[int(record["form"])], **variant},
    }


def chosen(problem: str, record: Data) -> int:
    """The row of the fastest setting that is good enough; else of the most exact one."""
    enough = good_enough(problem, record)
    if enough.any():
        return int(np.argmin(np.where(enough, record["seconds"], np.inf)))
    return int(np.argmin(np.nan_to_num(record["error"], nan=np.inf)))


def good_enough(problem: str, record: Data) -> Any:
    """Mask of the rows that reach the level of a problem: a small error, or every symbol right."""
    if problem not in LEVELS:
        return np.asarray(record["wrong_symbols"]) == 0
    error = np.nan_to_num(record["error"], nan=np.inf)
    return (error <= LEVELS[problem]) & (np.asarray(record["part"]) == 1)


def spelt(entry: dict[str, Any]) -> str:
    """A choice in words."""
    knob = "" if entry["knob"] is None else f"knob {entry['knob']:g}"
    return ", ".join(x for x in (knob, methods.spelt(entry["setting"])) if x)
