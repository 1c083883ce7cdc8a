"""The config of `experiment: asymptotic_orbits`: doubly asymptotic orbits with short codes."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rigidpend.config.bodies import BodyAtEnergy
from rigidpend.config.schema import DoubleNumerics, ExperimentConfig, Number, Whole
from rigidpend.numbers.checked import ParameterError
from rigidpend.routes.problem import RouteProblem

LEAST_J1_0 = 1e-280
"""Least J1_0."""


class Problem(BodyAtEnergy):
    """A heavy body, and limits on the doubly asymptotic orbits that are sought."""

    J1_0: Number
    """Action at which theta2_0 of an orbit is stated, dimensionless, 1e-280 to J2_0/2, small."""
    symbols: Annotated[Whole, Field(ge=0, le=8)]
    """Symbols of the longest codes: passages between the first crossing and the last."""
    half_turns: Annotated[Whole, Field(ge=1, le=1000)]
    """Largest number of half rotations in a passage."""
    drawn: Annotated[Whole, Field(ge=0, le=4)]
    """Number of orbits that are sampled: with no symbol, one, and so on up to `symbols`."""
    columns: Annotated[Whole, Field(ge=10, le=10_000)]
    """Phases of the route codes over which the orbits are drawn."""

    @property
    def routes(self) -> RouteProblem:
        """The problem of Fig. 4 whose plane the orbits divide."""
        return RouteProblem(self.body, self.h, self.J1_0, self.symbols + 1)

    @model_validator(mode="after")
    def _allowed(self) -> Self:
        # Orbits start at a far smaller J1 yet, which must be a normal double.
        most = float(self.routes.J2_0(53)) / 2
        if not LEAST_J1_0 <= float(self.J1_0) < most:
            said = f"expected {LEAST_J1_0:g} to less than J2_0/2 = {most:.4g}, got {self.J1_0}"
            raise ParameterError("J1_0", said)
        return self


class Config(ExperimentConfig):
    problem: Problem
    numerics: DoubleNumerics = DoubleNumerics()
