"""The config of `experiment: bench`: speed and error beside other methods."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from rigidpend.config.schema import ExperimentConfig, Number, Part, Whole, Word
from rigidpend.measure.benchmark.methods import METHODS
from rigidpend.measure.benchmark.problems import NAMES


def _of(kind: str, names: tuple[str, ...]) -> AfterValidator:
    def known(values: tuple[str, ...]) -> tuple[str, ...]:
        unknown = [value for value in values if value not in names]
        if unknown:
            raise ValueError(f"no such {kind}: {unknown[0]!r} (known: {', '.join(names)})")
        return values

    return AfterValidator(known)


def _descending(values: tuple[Any, ...]) -> tuple[Any, ...]:
    numbers = [float(x) for x in values]
    if not numbers or numbers != sorted(numbers, reverse=True) or numbers[-1] <= 0:
        raise ValueError("expected tolerances that descend and are more than 0")
    if numbers[0] > 0.1:
        raise ValueError(f"a tolerance is at most 0.1, got {values[0]}")
    return values


def _positive(x: Any) -> Any:
    if not 0 < float(x) <= 1e6:
        raise ValueError(f"expected seconds, more than 0 and at most 1e6, got {x}")
    return x


Methods = Annotated[tuple[str, ...], _of("method", tuple(METHODS))]
Seconds = Annotated[Number, AfterValidator(_positive)]
Count = Annotated[Whole, Field(ge=1, le=10**7)]
Counts = Annotated[tuple[Count, ...], Field(min_length=1)]


class Problem(Part):
    """Which problems, how large, and by which methods."""

    problems: Annotated[tuple[str, ...], _of("problem", NAMES)] = NAMES
    """Names of the problems to be solved."""
    methods: Methods = tuple(METHODS)
    """Names of the methods that solve them."""
    orbits: Count = 16
    """Orbits of the free body and of the pendulum, carried at once."""
    turns: Count = 25
    """How long these are followed, in turns about the third axis."""
    columns: Count = 63
    """Phases k/10 of Fig. 4."""
    n_symbols: Annotated[Whole, Field(ge=1, le=1000)] = 15
    """Symbols on each orbit of Fig. 4."""
    companions: Count = 8
    """Orbits over long times, carried at once."""
    periods: Count = 10**5
    """How long these are followed."""


class Scaling(Part):
    """The cost of codes against their number."""

    methods: Methods
    """Names of the methods whose cost is measured."""
    orbits: Counts
    """Numbers of orbits, from random phases."""
    symbols: Counts
    """Numbers of symbols, of as many orbits as there are columns."""
    seconds: Seconds
    """For the repetitions at each number."""


class Protocol(Part):
    """How well it is measured."""

    repeats: Annotated[Whole, Field(ge=1, le=100)] = 5
    """Of a solve; the median counts."""
    seconds: Seconds
    """Of solving, after which a method tries no further tolerance at a problem."""
    code_seconds: dict[Word, Seconds] = {}  # noqa: RUF012
    """The same at the codes, of methods that need another budget there."""
    long_seconds: Seconds
    """The same over long times, shared out evenly; what is expected within it is carried on."""
    tolerances: Annotated[tuple[Number, ...], AfterValidator(_descending)]
    """Local tolerances that a method with an adaptive step tries; descending."""
    steps: Counts
    """In a period, of methods with a fixed step; ascending."""
    long_tolerances: Annotated[tuple[Number, ...], AfterValidator(_descending)]
    """The same over long times; descending."""
    long_steps: Counts
    """Steps in a period over long times, of methods with a fixed step; ascending."""


class Config(ExperimentConfig):
    """A whole config."""

    experiment: Literal["bench"]
    problem: Problem = Problem()
    scaling: Scaling
    protocol: Protocol
