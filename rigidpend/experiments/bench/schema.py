"""The config of `experiment: bench`: speed and error beside other methods."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from rigidpend.config.schema import Count, ExperimentConfig, Number, Part, Whole, holding
from rigidpend.experiments.bench.methods import METHODS


def _known(values: tuple[str, ...]) -> tuple[str, ...]:
    unknown = [value for value in values if value not in METHODS]
    if unknown:
        raise ValueError(f"no such method: {unknown[0]!r} (known: {', '.join(METHODS)})")
    return values


Methods = Annotated[tuple[str, ...], AfterValidator(_known)]
Seconds = Annotated[
    Number, holding(lambda x: 0 < x <= 1e6, "expected seconds, more than 0 and at most 1e6")
]
Tolerance = Annotated[
    Number, holding(lambda x: 0 < x <= 0.1, "expected a tolerance, more than 0 and at most 0.1")
]


class Workload(Part):
    """Orbits of Fig. 4, and the methods that tell their symbols."""

    methods: Methods = tuple(METHODS)
    """Names of the methods."""
    columns: Count = 63
    """Phases k/10 of Fig. 4."""
    n_symbols: Annotated[Whole, Field(ge=1, le=1000)] = 15
    """Symbols on each orbit."""


class Search(Part):
    """Search for settings, each method alone."""

    tolerances: Annotated[tuple[Tolerance, ...], Field(min_length=1)]
    """Local tolerances of methods that choose their steps, dimensionless."""
    slowest: Seconds
    """Longest time for all orbits, seconds: a slower method meets none, and is tried no finer."""


class Meeting(Part):
    """Meeting: the chosen settings are timed in turn."""

    rounds: Annotated[Whole, Field(ge=1, le=100)] = 11
    """Rounds of a meeting; the median of their ratios counts."""
    seconds: Seconds
    """Time of one method in all, seconds; then it misses the rounds that are left."""


class RandomPhases(Part):
    """Random phases, whose symbols are compared with 113-bit arithmetic."""

    orbits: Count
    """Number of phases at most, for each J1_0."""
    seconds: Seconds
    """Budget of a method, seconds: after it no further phases are tried."""


class Bodies(Part):
    """Random bodies: the first call with each, and the same call again."""

    methods: Annotated[Methods, Field(min_length=1)]
    """Names of the methods; the first is ours."""
    kept: Annotated[Whole, Field(ge=0, le=1000)] = 40
    """Number of bodies that are the same in every run."""
    drawn: Annotated[Whole, Field(ge=0, le=1000)] = 20
    """Number of bodies that the seed draws."""
    seed: Whole = 1
    """Seed of the bodies that are drawn."""
    orbits: Count = 20_000
    """Orbits of each body, of 15 symbols."""
    seconds: Seconds
    """Time of a peer with a body, seconds of solving: a slow one follows fewer orbits.

    The truth, where two methods differ, has four times as much."""
    longest: Annotated[Whole, Field(ge=1, le=3600)] = 6
    """Longest time of ours with a body, seconds: it follows as many orbits as that allows."""


class Config(ExperimentConfig):
    problem: Workload = Workload()
    search: Search
    meeting: Meeting
    phases: RandomPhases
    bodies: Bodies
