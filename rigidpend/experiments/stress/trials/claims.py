"""Claims that a run may refute: each has its bound, and its known limit, before the run."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from rigidpend.experiments.data.tree import Tree
from rigidpend.experiments.stress.trials.fields import FAILED as FAILED
from rigidpend.experiments.stress.trials.fields import LIMIT as LIMIT
from rigidpend.experiments.stress.trials.fields import OF_CLAIM
from rigidpend.experiments.stress.trials.fields import PASSED as PASSED
from rigidpend.routes.problem import ProblemError


class Limit(NamedTuple):
    """A declaration that a claim's bound is known to be exceeded, and by how much at most."""

    why: str
    up_to: float
    """The largest value that the reason explains, in the claim's unit."""


class Claim(NamedTuple):
    """A sentence about the program that one number can refute."""

    name: str
    measured: str
    """The meaning of the number."""
    unit: str
    bound: float
    """The largest value that passes."""
    reason: str
    """Reason for the bound."""
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
    """The outcome of a trial: a number for each of its claims, by name."""

    values: Mapping[str, float]
    curves: Tree | None = None
    """Curves of what was measured behind the numbers."""
    notes: Mapping[str, str] | None = None
    """Further remarks on a claim in this run."""


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
        said = f"refused: {refused}"
        found = Findings({}, notes={claim.name: said for claim in trial.claims})
    return tree(trial.claims, found)


def tree(claims: Iterable[Claim], found: Findings) -> Tree:
    """Claims with what was found, as they are stored.

    Raises
    ------
    ValueError
        Something was measured that nothing was claimed of.
    """
    declared = {claim.name: claim for claim in claims}
    if undeclared := sorted(set(found.values) - set(declared)):
        raise ValueError(f"measured, but not declared before: {', '.join(undeclared)}")
    stored = {
        # What was claimed and not measured is NaN, which fails.
        name: _stored(claim, float(found.values.get(name, math.nan)), (found.notes or {}).get(name))
        for name, claim in declared.items()
    }
    return {"claims": stored, "curves": found.curves or {}}


def _stored(claim: Claim, value: float, note: str | None) -> Tree:
    why, up_to = claim.limit or ("", claim.bound)
    values = {
        "value": value,
        "bound": float(claim.bound),
        "ratio": float(claim.ratio(value)),
        "verdict": claim.verdict(value),
        "limit": why,
        "up_to": float(up_to),
        "note": note or "",
    }
    meaning: dict[str, dict[str, Any]] = {
        "value": {"units": claim.unit, "description": claim.measured},
        "bound": {"units": claim.unit, "description": claim.reason},
        "up_to": {"units": claim.unit},
    }
    return {
        name: field.dataset(values[name])._replace(**meaning.get(name, {}))
        for name, field in OF_CLAIM.items()
    }
