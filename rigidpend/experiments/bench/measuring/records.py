"""The data of a measurement: what a worker tells, as arrays with their meaning."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.experiments.data.tree import Dataset, Tree

MEANING = {
    "knob": ("1", "tolerance, or steps in a period; NaN where there is none"),
    "setting": ("1", "index of the variant, in the order of `variants`"),
    "error": ("1", "of the answer, as the problem defines it"),
    "worst": ("t' = t s", "largest error of a crossing time, over the columns"),
    "wrong": ("1", "share of wrong symbols"),
    "wrong_symbols": ("1", "number of wrong symbols"),
    "wrong_trusted": ("1", "number of wrong symbols that the method vouches for"),
    "undecided": ("1", "number of symbols that it does not vouch for"),
    "energy": ("1", "largest drift of the energy, relative"),
    "gamma": ("1", "largest drift of |gamma|, relative"),
    "area": ("1", "largest drift of M . gamma, in |M|"),
    "part": ("1", "how far the orbits were followed, of the whole way"),
    "orbits": ("1", "orbits that were measured; the time is scaled to all of the problem's"),
    "seconds": ("s", "warm, the median, scaled to the whole problem"),
    "once": ("s", "the same, of what was solved"),
    "repeats": ("1", "how many repetitions the median is of"),
    "prepare": ("s", "made ready and solved first, beyond a warm solve: compilation, mostly"),
    "memory": ("MB", "peak of the process so far"),
    "threads": ("1", "of those allowed at the meeting, as many as took it least time"),
    "rounds": ("s", "each round of the meeting, scaled to the whole problem; NaN: not timed"),
}
ONCE = {
    "import": ("s", "time to import its libraries, NumPy apart"),
    "memory_before": ("MB", "peak of the process before that import"),
}
PHASES = {
    "orbits": ("1", "random phases that were tried"),
    "symbols": ("1", "symbols compared with 113-bit arithmetic"),
    "wrong": ("1", "of them wrong"),
    "wrong_trusted": ("1", "of them wrong and vouched for; without a cross-check, all wrong ones"),
    "undecided": ("1", "of them not vouched for"),
    "seconds": ("s", "warm, one thread, for all these orbits"),
    "last_crossing": ("t' = t s", "median error of the last crossing; the truth has 7 decimals"),
}
MANY = {
    "orbits": ("1", "number of orbits from random phases"),
    "seconds": ("s", "warm, one thread, the median, for all these orbits"),
    "prepare": ("s", "what the first solve took beyond: tables of maps, compilation"),
    "repeats": ("1", "how many repetitions the median is of"),
    "undecided": ("1", "number of symbols that the method does not vouch for"),
}
FORM = {
    "form": ("1", "index of the form that was chosen"),
    "forms": ("text", "what each form took at the middle knob"),
}
CHOSEN = ("text", "the setting that the search chose")
ENDED = Dataset("", "text", "how the measurement ended: complete, cut at the budget, or why not")
COMPLETE = "complete"


def absent(library: str) -> Tree:
    """The record of a method that is not installed."""
    return {"ended": ENDED._replace(values=f"absent: {library} is not installed")}


def searched(lines: list[dict[str, Any]], ended: str, problem: str, planned: int) -> Tree:
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
    failed = next((line["failed"] for line in own if "failed" in line), "")
    found: dict[str, Any] = {"ended": ENDED._replace(values=_said(failed or ended, rows, planned))}
    for line in (line for line in own if "forms" in line):
        found["form"] = Dataset(float(line["form"]), *FORM["form"])
        found["forms"] = Dataset(line["forms"], *FORM["forms"])
    for told in lines[:1]:
        found |= {name: Dataset(float(told[name]), *meaning) for name, meaning in ONCE.items()}
    for name, meaning in MEANING.items():
        if rows and name in rows[0]:
            found[name] = Dataset(np.array([float(row[name]) for row in rows]), *meaning)
    return found


def met(line: dict[str, Any], setting: str) -> Tree:
    """The record of a method at a meeting."""
    found = {
        name: Dataset(np.array(line[name], dtype=float), *meaning)
        for name, meaning in MEANING.items()
        if name in line
    }
    return {**found, "chosen": Dataset(setting, *CHOSEN)}


def counted(line: dict[str, Any]) -> Tree:
    """The record of a method on random phases."""
    return {name: Dataset(float(line[name]), *meaning) for name, meaning in PHASES.items()}


def many(lines: list[dict[str, Any]], ended: str, setting: str) -> Tree:
    """The record of a method at ever more orbits."""
    found: dict[str, Any] = {
        name: Dataset(np.array([line[name] for line in lines], dtype=float), *meaning)
        for name, meaning in MANY.items()
    }
    said = ENDED._replace(values=ended or COMPLETE)
    return {**found, "chosen": Dataset(setting, *CHOSEN), "ended": said}


def _said(wrong: str, rows: list[Any], planned: int) -> str:
    if wrong:
        return f"{wrong}: {len(rows)} of {planned}"
    return f"cut at the budget: {len(rows)} of {planned}" if len(rows) < planned else COMPLETE
