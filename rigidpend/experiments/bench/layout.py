"""Layout of a result of `bench`: searches, meetings and random phases."""

from __future__ import annotations

from rigidpend.experiments.bench.measuring import records
from rigidpend.experiments.data.layout import (
    FLOAT,
    TEXT,
    Field,
    Layout,
)

ENDED = Field(TEXT, (), *records.ENDED[1:3])
SEARCHED: Layout = {
    "ended": ENDED,
    **{f"{name}?": Field(FLOAT, (), *said, gaps=True) for name, said in records.ONCE.items()},
    **{
        f"{name}?": Field(FLOAT, ("measurements",), *said, gaps=True)
        for name, said in records.MEANING.items()
        if name != "rounds"
    },
    "form?": Field(FLOAT, (), *records.FORM["form"]),
    "forms?": Field(TEXT, (), *records.FORM["forms"]),
}
"""Record of a method's search at a problem; what it did not measure is absent."""
MET: Layout = {
    **{
        f"{name}?": Field(FLOAT, (), *said, gaps=True)
        for name, said in records.MEANING.items()
        if name != "rounds"
    },
    "rounds": Field(FLOAT, ("rounds",), *records.MEANING["rounds"], gaps=True),
    "chosen": Field(TEXT, (), *records.CHOSEN),
}
"""Record of a method at a meeting, with the setting that was chosen for it."""
COUNTED: Layout = {
    name: Field(FLOAT, (), *said, gaps=True) for name, said in records.PHASES.items()
}
"""Record of a method on random phases."""
MANY: Layout = {
    **{name: Field(FLOAT, ("numbers",), *said) for name, said in records.MANY.items()},
    "chosen": Field(TEXT, (), *records.CHOSEN),
    "ended": ENDED,
}
"""Record of a method at ever more orbits."""
PROBLEM = {
    "title": Field(TEXT, (), "text", "the problem"),
    "error": Field(TEXT, (), "text", "what its error is"),
    "default": Field(TEXT, (), "text", "the method that rigidpend picks"),
}

LAYOUT: Layout = {
    "<problems>": {**PROBLEM, "<methods>": SEARCHED},
    "meetings": {"<threads>": {"<problems that met>": {"ended": ENDED, "<methods that met>": MET}}},
    "random_phases": {"<starts>": {"<methods>": COUNTED}},
    "many_orbits?": {"<methods of many>": MANY},
}
