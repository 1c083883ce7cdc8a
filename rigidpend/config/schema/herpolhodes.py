"""The config of `experiment: herpolhodes`: the angular velocity in space (Fig. 5)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rigidpend.config.schema.base import HeavyBody, Number, Numerics, Part, Whole, Word, physics


class Case(Part):
    """An orbit."""

    theta2_0: Number
    """Initial phase in radians."""


class Problem(HeavyBody):
    """Orbits that start at theta1_0 = alpha0 + beta0, J2_0 = sqrt(2 h0/kappa), theta3_0 = 0."""

    h0: Number
    """Energy constant, h0 > mu."""
    J1_0: Number
    """Initial action, dimensionless, 0 < J1_0 < J2_0."""
    n_symbols: Annotated[Whole, Field(ge=1, le=50)] = 5
    """Turns from a separatrix to the next on each route, at most 50."""
    n_wound: Annotated[Whole, Field(ge=1)] = 3
    """Separatrices that the curve (omega_zeta, omega_xi) runs along, n_symbols at most."""
    cases: Annotated[dict[Word, Case], Field(min_length=1, max_length=4)]
    """Named orbits."""

    @model_validator(mode="after")
    def _physics(self) -> Problem:
        from rigidpend.routes.problem import ProblemError, RouteProblem

        with physics():
            RouteProblem(self.body, self.h0, self.J1_0, self.n_symbols)
            if self.n_wound > self.n_symbols:
                message = f"n_wound = {self.n_wound} is more than n_symbols = {self.n_symbols}"
                raise ProblemError("n_wound", message)
        return self


class HerpolhodeNumerics(Numerics):
    """How well it is computed, and how densely sampled."""

    points: Annotated[Whole, Field(ge=8, le=1000)] = 60
    """Samples in a rotation of the pendulum."""


class Config(Part):
    """A whole config."""

    figure: str
    """Which figure it makes; 5 is the paper's Fig. 5."""
    experiment: Literal["herpolhodes"]
    problem: Problem
    numerics: HerpolhodeNumerics = HerpolhodeNumerics()
