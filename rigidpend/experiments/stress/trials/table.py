"""The claims of a stored result as a table, and as plain data."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

from rigidpend.experiments.data.tree import Data
from rigidpend.experiments.stress.trials.claims import FAILED, LIMIT, PASSED


class Line(NamedTuple):
    """A claim as it was stored."""

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
    note: str


def lines(data: Data) -> Iterator[Line]:
    """All claims of a result's data, a tree with its meanings (see `store.read_tree`)."""
    for group, content in data.items():
        for name, claim in content["claims"].items():
            yield Line(
                group,
                name,
                str(claim["value"].description),
                str(claim["value"].units),
                float(claim["value"].values),
                float(claim["bound"].values),
                float(claim["ratio"].values),
                str(claim["verdict"].values),
                str(claim["bound"].description),
                str(claim["limit"].values),
                str(claim["note"].values),
            )


def summary(data: Data) -> dict[str, Any]:
    """Counts and claims as JSON can hold them: what is not finite is a text."""
    told = [{key: _plain(value) for key, value in line._asdict().items()} for line in lines(data)]
    return {"counts": counts(data), "claims": told}


def counts(data: Data) -> dict[str, int]:
    """The number of claims of each verdict."""
    counted = Counter(line.verdict for line in lines(data))
    return {verdict: counted[verdict] for verdict in (PASSED, LIMIT, FAILED)}


def text(data: Data) -> Iterator[str]:
    """The table for people: by how much each claim passes, then what does not and why."""
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
            why = "; ".join(filter(None, (line.measured, line.note, line.limit)))
            yield f"{line.verdict}: {line.group}, {line.name}: {why}"
    yield ", ".join(f"{number} {verdict}" for verdict, number in counts(data).items())


def _plain(value: Any) -> Any:
    if isinstance(value, float) and not abs(value) < float("inf"):
        return str(value)
    return value
