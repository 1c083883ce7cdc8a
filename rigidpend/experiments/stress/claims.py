"""Claims that a run may refute: each has its bound, and its known limit, before the run."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from rigidpend.experiments.data import Fields, Tree, datasets
from rigidpend.experiments.stress import FAILED, LIMIT, OF_CLAIM, PASSED
from rigidpend.routes.problem import ProblemError


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
    limit: str = ""
    """Reason for which its bound is known to be exceeded, where it is."""
    up_to: float = -math.inf
    """The largest value that this explains."""

    def verdict(self, value: float) -> str:
        """The verdict on a measured value; NaN, which is no measurement, fails."""
        return PASSED if value <= self.bound else LIMIT if value <= self.up_to else FAILED

    def ratio(self, value: float) -> float:
        """Value over bound; 0 where both are, infinite where the bound alone is 0."""
        if self.bound:
            return value / self.bound
        return 0.0 if value == 0 else math.inf

    def told(self, value: float, note: str) -> Tree:
        """The claim with what was found, as it is stored."""
        texts = {"verdict": self.verdict(value), "limit": self.limit, "note": note}
        up_to = float(max(self.bound, self.up_to))
        numbers = {"value": value, "bound": float(self.bound), "up_to": up_to}
        found = datasets(OF_CLAIM, {**texts, **numbers, "ratio": float(self.ratio(value))})
        said = {"value": self.measured, "bound": self.reason, "up_to": found["up_to"].description}
        meant = {k: found[k]._replace(units=self.unit, description=x) for k, x in said.items()}
        return {**found, **meant}


class Findings(NamedTuple):
    """The outcome of a trial: a number for each of its claims, in their order."""

    values: Sequence[float]
    notes: Sequence[str] = ()
    """Further remarks on the claims in this run, in their order."""
    curves: Mapping[str, Any] | None = None
    """Values behind the numbers, of the fields of the trial's curves."""


class Trial(NamedTuple):
    """Claims, and the measurement that tests them all."""

    kind: str
    name: str
    claims: Sequence[Claim]
    measure: Callable[[], Findings]
    curves: Fields = MappingProxyType({})
    """Fields of the curves that it finds."""


def tried(trial: Trial) -> Tree:
    """Measure a trial; what it refuses to compute refutes all that it claims.

    Raises
    ------
    ValueError
        Something was measured that nothing was claimed of.
    """
    try:
        found = trial.measure()
    except (ProblemError, ArithmeticError) as refused:
        found = Findings([], [f"refused: {refused}"] * len(trial.claims))
    if len(found.values) > len(trial.claims):
        said = f"measured {len(found.values)} values, declared {len(trial.claims)} before"
        raise ValueError(said)
    rows = itertools.zip_longest(trial.claims, found.values, found.notes)
    # What was claimed and not measured is NaN, which fails.
    claims = {
        claim.name: claim.told(math.nan if value is None else float(value), note or "")
        for claim, value, note in rows
    }
    return {
        "claims": claims,
        "curves": datasets(trial.curves, found.curves) if found.curves else {},
    }
