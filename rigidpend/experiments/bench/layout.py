"""Layout of a result of `bench`: searches, meetings and random phases."""

from __future__ import annotations

import sys

from rigidpend.experiments.bench.measuring import records
from rigidpend.experiments.data.compare import Difference
from rigidpend.experiments.data.layout import ANY, FLOAT, TEXT, Bound, Field, Layout
from rigidpend.experiments.data.tree import Data

SAME, CHAOTIC = 30, 1e-3
"""Allowed factor between errors: where rounding rules, and where chaos magnifies it."""


def _errors(name: str, stored: Data, fresh: Data) -> list[Difference]:
    """Errors agree but for rounding, setting by setting; what one run alone measured is passed."""
    found, at = [], {_key(fresh, k): k for k in range(len(fresh["knob"]))}
    for i, old in enumerate(stored[name]):
        k, knob = at.get(_key(stored, i)), f"at {stored['knob'][i]:g}"
        if k is None or not old < CHAOTIC or stored["part"][i] != fresh["part"][k]:
            continue
        most = SAME * max(old, sys.float_info.epsilon)
        if not fresh[name][k] <= most:
            found.append(Difference(f"{name} {knob}", old, fresh[name][k], most))
        if "wrong_symbols" in stored:
            before, wrong = stored["wrong_symbols"][i], fresh["wrong_symbols"][k]
            if wrong > before:
                found.append(Difference(f"wrong_symbols {knob}", before, wrong))
    return found


def _key(record: Data, k: int) -> str:
    return f"{record['knob'][k]:.6g} {record['setting'][k]:g}"


ERRORS = {"error": Bound(_errors, sized=False)}
"""Times are never compared, and errors only of the search; the rest tells how, not what."""
ENDED = Field(TEXT, (), *records.ENDED[1:3], within=ANY)
SEARCHED: Layout = {
    "ended": ENDED,
    **{
        f"{name}?": Field(FLOAT, (), *said, gaps=True, within=ANY)
        for name, said in records.ONCE.items()
    },
    **{
        f"{name}?": Field(FLOAT, ("measurements",), *said, gaps=True, within=ERRORS.get(name, ANY))
        for name, said in records.MEANING.items()
        if name != "rounds"
    },
    "form?": Field(FLOAT, (), *records.FORM["form"], within=ANY),
    "forms?": Field(TEXT, (), *records.FORM["forms"], within=ANY),
}
"""Record of a method's search at a problem; what it did not measure is absent."""
MET: Layout = {
    **{
        f"{name}?": Field(FLOAT, (), *said, gaps=True, within=ANY)
        for name, said in records.MEANING.items()
        if name != "rounds"
    },
    "rounds": Field(FLOAT, ("rounds",), *records.MEANING["rounds"], gaps=True, within=ANY),
    "chosen": Field(TEXT, (), *records.CHOSEN, within=ANY),
}
"""Record of a method at a meeting, with the setting that was chosen for it."""
COUNTED: Layout = {
    name: Field(FLOAT, (), *said, gaps=True, within=ANY) for name, said in records.PHASES.items()
}
"""Record of a method on random phases."""
MANY: Layout = {
    **{name: Field(FLOAT, ("numbers",), *said, within=ANY) for name, said in records.MANY.items()},
    "chosen": Field(TEXT, (), *records.CHOSEN, within=ANY),
    "ended": ENDED,
}
"""Record of a method at ever more orbits."""
PROBLEM = {
    "title": Field(TEXT, (), "text", "the problem", within=ANY),
    "error": Field(TEXT, (), "text", "what its error is", within=ANY),
    "default": Field(TEXT, (), "text", "the method that rigidpend picks", within=ANY),
}

LAYOUT: Layout = {
    "<problems>": {**PROBLEM, "<methods>": SEARCHED},
    "meetings": {"<threads>": {"<problems that met>": {"ended": ENDED, "<methods that met>": MET}}},
    "random_phases": {"<starts>": {"<methods>": COUNTED}},
    "many_orbits?": {"<methods of many>": MANY},
}
