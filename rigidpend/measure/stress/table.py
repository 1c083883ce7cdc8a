"""The cases of a stored result as a table, and as plain data."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

from rigidpend.measure.stress.cases import FAILED, LIMIT, PASSED


class Line(NamedTuple):
    """A case as it was stored."""

    group: str
    name: str
    measured: str
    unit: str
    value: float
    bound: float
    ratio: float
    verdict: str
    reason: str
    limit: str


def lines(data: Any) -> Iterator[Line]:
    """All cases of a result's data, a tree with its meanings (see `store.read_tree`)."""
    for group, content in data.items():
        for name, case in content["cases"].items():
            yield Line(
                group,
                name,
                str(case["value"].description),
                str(case["value"].units),
                float(case["value"].values),
                float(case["bound"].values),
                float(case["ratio"].values),
                str(case["verdict"].values),
                str(case["bound"].description),
                str(case["limit"].values),
            )


def summary(data: Any) -> dict[str, Any]:
    """Counts and cases as JSON can hold them: what is not finite is a text."""
    cases = [{key: _plain(value) for key, value in line._asdict().items()} for line in lines(data)]
    return {"counts": counts(data), "cases": cases}


def counts(data: Any) -> dict[str, int]:
    """How many cases have each verdict."""
    counted = Counter(line.verdict for line in lines(data))
    return {verdict: counted[verdict] for verdict in (PASSED, LIMIT, FAILED)}


def text(data: Any) -> Iterator[str]:
    """The table for people: by how much each case passes, then what does not and why."""
    found = list(lines(data))
    width = max(len(line.name) for line in found)
    group = ""
    for line in found:
        if line.group != group:
            group = line.group
            yield f"\n{group.replace('_', ' '):<{width + 2}}  {'value':>9}  {'bound':>9}  of bound"
        numbers = f"{line.value:9.2g}  {line.bound:9.2g}  {line.ratio:8.2g}"
        yield f"  {line.name:<{width}}  {numbers}  {line.verdict} ({line.unit})"
    yield ""
    for line in found:
        if line.verdict != PASSED:
            why = f"; {line.limit}" if line.limit else ""
            yield f"{line.verdict}: {line.group}, {line.name}: {line.measured}{why}"
    yield ", ".join(f"{number} {verdict}" for verdict, number in counts(data).items())


def _plain(value: Any) -> Any:
    if isinstance(value, float) and not abs(value) < float("inf"):
        return str(value)
    return value
