"""How many trials of each kind pass, how close the closest, and what does not."""

from __future__ import annotations

from collections import Counter
from typing import Any

from rigidpend.measure.stress.cases import FAILED, LIMIT, PASSED
from rigidpend.tables import Table


def tables(result: Any) -> list[Table]:
    """The trials by kind, then those beyond their bounds, from a loaded result."""
    groups = {name: content["cases"] for name, content in result["data"].items()}
    counted = Table(
        "Trials, and the largest part of its bound that one which passed reached",
        ("kind", PASSED, LIMIT, FAILED, "largest part"),
        [_counts(name, cases) for name, cases in groups.items()],
    )
    beyond = [
        (str(case["verdict"]), f"{group.replace('_', ' ')}, {name}", str(case["limit"]))
        for group, cases in groups.items()
        for name, case in cases.items()
        if case["verdict"] != PASSED
    ]
    if not beyond:
        return [counted]
    return [counted, Table("Beyond their bounds", ("verdict", "trial", "reason"), beyond)]


def _counts(name: str, cases: Any) -> tuple[str, ...]:
    verdicts = Counter(str(case["verdict"]) for case in cases.values())
    parts = [float(case["ratio"]) for case in cases.values() if case["verdict"] == PASSED]
    numbers = (str(verdicts[verdict]) for verdict in (PASSED, LIMIT, FAILED))
    return (name.replace("_", " "), *numbers, f"{max(parts, default=0):.2g}")
