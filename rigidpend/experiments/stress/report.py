"""Tables of the trials: passed by kind, the closest one, the failures; and every claim."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.stress import FAILED, LIMIT, PASSED
from rigidpend.machine.wording import Table, terminal

CAPTION = (
    "Each trial goes to a limit, and its value stays below the bound that was stated before it"
    " ran: its share of it is less than 1. Drift of the integrals, growth of errors from passage"
    " to passage, and how many symbols each precision decides."
)


def tables(result: Loaded) -> list[Table]:
    """The trials by kind, then those beyond their bounds, from a loaded result."""
    groups = {name: content["claims"] for name, content in result["data"].items()}
    counted = Table(
        "Trials, and the largest part of its bound that one which passed reached",
        ("kind", PASSED, LIMIT, FAILED, "largest part"),
        [_counts(name, claims) for name, claims in groups.items()],
    )
    beyond = [
        (str(claim["verdict"]), f"{group.replace('_', ' ')}, {name}", str(claim["limit"]))
        for group, claims in groups.items()
        for name, claim in claims.items()
        if claim["verdict"] != PASSED
    ]
    if not beyond:
        return [counted]
    return [counted, Table("Beyond their bounds", ("verdict", "trial", "reason"), beyond)]


def _counts(name: str, claims: Any) -> tuple[str, ...]:
    verdicts = Counter(str(claim["verdict"]) for claim in claims.values())
    parts = [float(claim["ratio"]) for claim in claims.values() if claim["verdict"] == PASSED]
    numbers = (str(verdicts[verdict]) for verdict in (PASSED, LIMIT, FAILED))
    return (name.replace("_", " "), *numbers, f"{max(parts, default=0):.2g}")


def lines(data: Data) -> list[dict[str, Any]]:
    """All claims of a result's data, a tree with its meanings (see `store.read_tree`)."""
    found = []
    for group, content in data.items():
        for name, claim in content["claims"].items():
            numbers = {key: float(claim[key].values) for key in ("value", "bound", "ratio")}
            texts = {key: str(claim[key].values) for key in ("verdict", "limit", "note")}
            value, reason = claim["value"], claim["bound"].description
            meant = {"measured": value.description, "unit": value.units, "reason": reason}
            found.append({"group": group, "name": name, **meant, **numbers, **texts})
    return found


def summary(data: Data) -> dict[str, Any]:
    """Counts and claims as JSON can hold them: what is not finite is a text."""
    told = [{key: _plain(value) for key, value in line.items()} for line in lines(data)]
    return {"counts": counts(data), "claims": told}


def counts(data: Data) -> dict[str, int]:
    """The number of claims of each verdict."""
    counted = Counter(line["verdict"] for line in lines(data))
    return {verdict: counted[verdict] for verdict in (PASSED, LIMIT, FAILED)}


def text(data: Data) -> Iterator[str]:
    """All for people: by how much each claim passes, then what does not and why."""
    found = lines(data)
    header = ("claim", "value", "bound", "of bound", "unit", "verdict")
    for group in data:
        rows = [
            (
                x["name"],
                *(f"{x[key]:.2g}" for key in ("value", "bound", "ratio")),
                x["unit"],
                x["verdict"],
            )
            for x in found
            if x["group"] == group
        ]
        yield from terminal(Table(group.replace("_", " "), header, rows))
    for x in found:
        if x["verdict"] != PASSED:
            why = "; ".join(filter(None, (x["measured"], x["note"], x["limit"])))
            yield f"{x['verdict']}: {x['group']}, {x['name']}: {why}"
    yield ", ".join(f"{number} {verdict}" for verdict, number in counts(data).items())


def _plain(value: Any) -> Any:
    return str(value) if isinstance(value, float) and not abs(value) < float("inf") else value
