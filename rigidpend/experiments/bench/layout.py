"""What a result of `bench` consists of."""

from __future__ import annotations

from rigidpend.measure.benchmark import records
from rigidpend.results.layout import FLOAT, TEXT, Field, Layout

RECORD: Layout = {
    "ended": Field(TEXT, (), *records.ENDED[1:]),
    **{f"{name}?": Field(FLOAT, (), *said, gaps=True) for name, said in records.ONCE.items()},
    **{
        f"{name}?": Field(FLOAT, ("measurements",), *said, gaps=True)
        for name, said in records.MEANING.items()
    },
}
"""What is told of a method; what it did not measure is absent."""
PROBLEM = {
    "title": Field(TEXT, (), "text", "the problem"),
    "error": Field(TEXT, (), "text", "what its error is"),
    "default": Field(TEXT, (), "text", "the method that rigidpend picks"),
}
LAYOUT: Layout = {
    "<problems>": {**PROBLEM, "<methods>": RECORD},
    "scaling": {name: {f"<methods against {name}>": RECORD} for name in ("orbits", "symbols")},
}
