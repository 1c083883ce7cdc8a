"""The config of `experiment: bench`: speed and error beside other methods."""

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
    """Orbits of Fig. 4, and the methods that find their symbols."""

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
    """Longest time for all orbits, seconds: a slower setting meets nobody and is tried no finer."""


class Meeting(Part):
    """Meeting: the chosen settings are timed in turn."""

    rounds: Annotated[Whole, Field(ge=1, le=100)] = 11
    """Rounds of a meeting; the median of their ratios counts."""
    seconds: Seconds
    """Total time of one method, seconds; after it the method misses the remaining rounds."""


class RandomPhases(Part):
    """Random phases, whose symbols are compared with 113-bit arithmetic."""

    orbits: Count
    """Largest number of phases for each J1_0."""
    seconds: Seconds
    """Budget of a method, seconds: after it no further phases are tried."""


class Bodies(Part):
    """Randomly drawn bodies: the first call with each, and the same call again."""

    methods: Annotated[Methods, Field(min_length=1)]
    """Names of the methods; the first is ours."""
    kept: Annotated[Whole, Field(ge=0, le=1000)] = 40
    """Number of bodies that are the same in every run."""
    drawn: Annotated[Whole, Field(ge=0, le=1000)] = 20
    """Number of bodies that the seed draws."""
    seed: Whole = 1
    """Seed of these bodies."""
    orbits: Count = 20_000
    """Number of orbits of each body, with 15 symbols."""
    seconds: Seconds
    """Time of a peer for a body, seconds of solving: a slow peer follows fewer orbits.

    The truth, where two methods differ, may take four times as long."""
    longest: Annotated[Whole, Field(ge=1, le=3600)] = 12
    """Expected time of ours for a body, seconds of a core: fewer orbits where all take longer."""


class Config(ExperimentConfig):
    problem: Workload = Workload()
    search: Search
    meeting: Meeting
    phases: RandomPhases
    bodies: Bodies
