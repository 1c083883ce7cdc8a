"""What a trial is: a value, a bound with its reason, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from rigidpend.results.tree import Dataset, Tree

PASSED, LIMIT, FAILED = "passed", "limit", "FAILED"
"""Verdicts: within the bound; beyond it, for a documented reason; beyond it."""


class Case(NamedTuple):
    """One trial."""

    name: str
    measured: str
    """What the value is."""
    unit: str
    value: float
    """NaN where it could not be measured, which is a failure."""
    bound: float
    """The largest value that passes."""
    reason: str
    """Why the bound is what it is."""
    limit: str = ""
    """Where it is known that the case fails: why."""

    @property
    def verdict(self) -> str:
        if self.value <= self.bound:
            return PASSED
        return LIMIT if self.limit else FAILED

    @property
    def ratio(self) -> float:
        """Value over bound; 0 where both are, infinite where the bound alone is 0."""
        if self.bound:
            return self.value / self.bound
        return 0.0 if self.value == 0 else math.inf


def tree(cases: Iterable[Case], curves: Tree | None = None) -> Tree:
    """Cases and the curves behind them, as they are stored."""
    return {"cases": {case.name: _stored(case) for case in cases}, "curves": curves or {}}


def _stored(case: Case) -> Tree:
    return {
        "value": Dataset(float(case.value), case.unit, case.measured),
        "bound": Dataset(float(case.bound), case.unit, case.reason),
        "ratio": Dataset(float(case.ratio), "1", "value over bound"),
        "verdict": Dataset(case.verdict, "", "passed, limit (documented), FAILED"),
        "limit": Dataset(case.limit, "", "why it is known to exceed the bound, if it is"),
    }
