"""Tables of the trials: passed by kind, the closest one, and the failures."""

from __future__ import annotations

from collections import Counter
from typing import Any

from rigidpend.experiments.data.tree import Loaded
from rigidpend.experiments.stress.trials.claims import FAILED, LIMIT, PASSED
from rigidpend.machine.tables import Table

CAPTION = (
    "Trials at the limits: drift of the integrals, every trial's value as a share of the bound"
    " stated before it ran, growth of errors from passage to passage, and how many symbols each"
    " precision decides."
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
