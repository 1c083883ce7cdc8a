"""The config of `experiment: stress`: trials at the limits of the package's claims."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, model_validator

from rigidpend.config.bodies import HeavyBody
from rigidpend.config.schema import Count, ExperimentConfig, Number, Part, Whole, holding

Spoilt = Annotated[
    Number, holding(lambda x: 1e-13 <= x <= 1e-2, "a spoilt tolerance is from 1e-13 to 0.01")
]
Precision: TypeAlias = Literal["53", "64", "106", "113"]
"""Bits that decide symbols alone."""


class LongTime(Part):
    """Length of the trials of integrals, in rotations of the pendulum."""

    rotations: Annotated[Count, Field(ge=1000)] = 10**6
    """Number of rotations that are followed."""
    orbits: Count = 32
    """Number of orbits that are followed."""


class Extremes(Part):
    """Bodies, energies and starts at the ends of their ranges."""

    columns: Annotated[Whole, Field(ge=1, le=8)] = 8
    """Number of orbits for each."""
    n_symbols: Annotated[Whole, Field(ge=1, le=15)] = 15
    """Symbols on each orbit, fewer where a passage takes many rotations."""


class Passages(Part):
    """Growth of errors from passage to passage."""

    orbits: Count = 64
    """Number of orbits whose errors are measured."""
    n_crossings: Annotated[Whole, Field(ge=8, le=20)] = 16
    """Number of crossings on each orbit."""
    columns: dict[Precision, Count]
    """Number of orbits on which each precision decides as many symbols as it can."""
    checked: dict[Precision, Count]
    """Number of them that are compared with a higher precision."""


class Honesty(Part):
    """Flags `certain` at spoilt tolerances."""

    orbits: Count = 100_000
    """Number of orbits, all followed at every tolerance."""
    checked: Annotated[Whole, Field(ge=3, le=10**5)] = 150
    """Number of them that are followed in principal axes in 113 bits in any case."""
    tolerances: Annotated[tuple[Spoilt, ...], Field(min_length=1, max_length=10)]
    """Local tolerances in double precision, dimensionless."""


class Addresses(Part):
    """Orbits found from random codes, and from longer addresses of the same symbols."""

    bodies: Annotated[Whole, Field(ge=0, le=1000)] = 8
    """Random bodies, beside the body of this config."""
    words: Count = 5
    """Codes of each body; two orbits are found for each."""
    n_symbols: Annotated[Whole, Field(ge=1, le=10)] = 10
    """Symbols of each code."""


class Problem(HeavyBody):
    """The body of trials that have none of their own, and the numbers of trials."""

    h0: Number
    """Energy constant, h0 > mu; physical units, as mu."""
    J1_0: Number
    """Initial action, dimensionless, 0 < J1_0 < J2_0, not J2_0/2."""
    seed: Whole = 1
    """Seed of the random phases."""
    long_time: LongTime = LongTime()
    extremes: Extremes = Extremes()
    passages: Passages
    honesty: Honesty
    addresses: Addresses = Addresses()

    @model_validator(mode="after")
    def _physics(self) -> Problem:
        from rigidpend.routes.problem import RouteProblem

        RouteProblem(self.body, self.h0, self.J1_0, 1)
        return self


class Config(ExperimentConfig):
    problem: Problem
