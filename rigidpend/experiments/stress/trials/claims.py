"""Claims that a run may refute: each has its bound, and its known limit, before the run."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rigidpend.experiments.data.tree import Tree
from rigidpend.experiments.stress.layout import FAILED, LIMIT, OF_CLAIM, PASSED
from rigidpend.routes.problem import ProblemError


class Limit(NamedTuple):
    """A declaration that a claim's bound is known to be exceeded, and by how much at most."""

    why: str
    up_to: float
    """The largest value that the reason explains, in the claim's unit."""


class Claim(NamedTuple):
    """A sentence about the program that one number can refute."""

    name: str
    bound: float
    """The largest value that passes."""
    measured: str
    """The meaning of the number."""
    reason: str
    """Reason for the bound."""
    unit: str = "1"
    limit: Limit | None = None

    def verdict(self, value: float) -> str:
        """The verdict on a measured value; NaN, which is no measurement, fails."""
        if value <= self.bound:
            return PASSED
        return LIMIT if self.limit and value <= self.limit.up_to else FAILED

    def ratio(self, value: float) -> float:
        """Value over bound; 0 where both are, infinite where the bound alone is 0."""
        if self.bound:
            return value / self.bound
        return 0.0 if value == 0 else math.inf


class Findings(NamedTuple):
    """The outcome of a trial: a number for each of its claims, in their order."""

    values: Sequence[float]
    curves: Tree | None = None
    """Curves of what was measured behind the numbers."""
    notes: Sequence[str] = ()
    """Further remarks on the claims in this run, in their order."""


class Trial(NamedTuple):
    """Claims, and the measurement that tests them all."""

    name: str
    claims: tuple[Claim, ...]
    measure: Callable[[], Findings]


def tried(trial: Trial) -> Tree:
    """Measure a trial; what it refuses to compute refutes all that it claims."""
    try:
        found = trial.measure()
    except (ProblemError, ArithmeticError) as refused:
        found = Findings([], notes=[f"refused: {refused}"] * len(trial.claims))
    return tree(trial.claims, found)


def tree(claims: Sequence[Claim], found: Findings) -> Tree:
    """Claims with what was found, as they are stored.

    Raises
    ------
    ValueError
        Something was measured that nothing was claimed of.
    """
    if len(found.values) > len(claims):
        raise ValueError(f"measured {len(found.values)} values, declared {len(claims)} before")
    rows = itertools.zip_longest(claims, found.values, found.notes)
    stored = {
        # What was claimed and not measured is NaN, which fails.
        claim.name: _stored(claim, math.nan if value is None else float(value), note or "")
        for claim, value, note in rows
    }
    return {"claims": stored, "curves": found.curves or {}}


def _stored(claim: Claim, value: float, note: str) -> Tree:
    why, up_to = claim.limit or ("", claim.bound)
    numbers = {"value": value, "bound": claim.bound, "ratio": claim.ratio(value), "up_to": up_to}
    texts = {"verdict": claim.verdict(value), "limit": why, "note": note}
    values = {**texts, **{name: float(number) for name, number in numbers.items()}}
    meaning: dict[str, dict[str, Any]] = {
        "value": {"units": claim.unit, "description": claim.measured},
        "bound": {"units": claim.unit, "description": claim.reason},
        "up_to": {"units": claim.unit},
    }
    return {
        name: field.dataset(values[name])._replace(**meaning.get(name, {}))
        for name, field in OF_CLAIM.items()
    }
