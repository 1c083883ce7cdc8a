"""The config of `experiment: herpolhodes`: the angular velocity in space (Fig. 5)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rigidpend.config.route_start import RouteStart
from rigidpend.config.schema import ExperimentConfig, Number, Numerics, Part, Whole, Word, physics


class HerpolhodeCase(Part):
    """An orbit."""

    theta2_0: Number
    """Initial phase in radians."""


class Problem(RouteStart):
    """Named orbits with theta3_0 = 0."""

    n_symbols: Annotated[Whole, Field(ge=1, le=50)] = 5
    """Turns from a separatrix to the next on each route, at most 50."""
    n_wound: Annotated[Whole, Field(ge=1)] = 3
    """Separatrices that the curve (omega_zeta, omega_xi) runs along, n_symbols at most."""
    cases: Annotated[dict[Word, HerpolhodeCase], Field(min_length=1, max_length=4)]
    """Named orbits."""

    @model_validator(mode="after")
    def _physics(self) -> Problem:
        from rigidpend.routes.problem import ProblemError

        with physics():
            if self.n_wound > self.n_symbols:
                message = f"n_wound = {self.n_wound} is more than n_symbols = {self.n_symbols}"
                raise ProblemError("n_wound", message)
        return self


class HerpolhodeNumerics(Numerics):
    """How well it is computed, and how densely sampled."""

    points: Annotated[Whole, Field(ge=8, le=1000)] = 60
    """Samples in a rotation of the pendulum."""


class Config(ExperimentConfig):
    """A whole config."""

    experiment: Literal["herpolhodes"]
    problem: Problem
    numerics: HerpolhodeNumerics = HerpolhodeNumerics()
