"""The config of `experiment: herpolhodes`: the angular velocity in space (Fig. 5)."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from rigidpend.config.bodies import RouteStart
from rigidpend.config.schema import ExperimentConfig, Number, Numerics, Part, Whole, Word
from rigidpend.numbers.checked import ParameterError


class HerpolhodeCase(Part):
    """An orbit of the figure."""

    theta2_0: Number
    """Initial phase in radians."""


class Problem(RouteStart):
    """Named orbits with theta3_0 = 0."""

    n_symbols: Annotated[Whole, Field(ge=1, le=50)] = 5
    """Number of symbols, that is of turns from one separatrix to the next, at most 50."""
    n_wound: Annotated[Whole, Field(ge=1)] = 3
    """Number of separatrices along the curve (omega_zeta, omega_xi), n_symbols at most."""
    cases: Annotated[dict[Word, HerpolhodeCase], Field(min_length=1, max_length=4)]
    """Named orbits."""

    @model_validator(mode="after")
    def _physics(self) -> Problem:
        if self.n_wound > self.n_symbols:
            message = f"n_wound = {self.n_wound} is more than n_symbols = {self.n_symbols}"
            raise ParameterError("n_wound", message)
        return self


class HerpolhodeNumerics(Numerics):
    """Numerics with the density of the samples."""

    points: Annotated[Whole, Field(ge=8, le=1000)] = 60
    """Number of samples in a rotation of the pendulum."""


class Config(ExperimentConfig):
    problem: Problem
    numerics: HerpolhodeNumerics = HerpolhodeNumerics()
