"""The config of `experiment: route_codes`: orbits on S1- and their symbols (Fig. 4)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rigidpend.config.schema.base import (
    Grid,
    HeavyBody,
    Number,
    Numerics,
    Part,
    Whole,
    Word,
    physics,
)


class Problem(HeavyBody):
    """Orbits that start at theta1_0 = alpha0 + beta0 and J2_0 = sqrt(2 h0/kappa)."""

    h0: Number
    """Energy constant, h0 > mu."""
    J1_0: Number
    """Initial action, dimensionless, 0 < J1_0 < J2_0, not J2_0/2."""
    n_symbols: Whole = 15
    """Symbols on each orbit."""
    arrays: Annotated[dict[Word, Grid], Field(min_length=1)]
    """Named sets of initial phases theta2_0."""

    @model_validator(mode="after")
    def _physics(self) -> Problem:
        from rigidpend.routes.problem import RouteProblem

        with physics():
            RouteProblem(self.body, self.h0, self.J1_0, self.n_symbols)
        return self


class Config(Part):
    """A whole config."""

    figure: str
    """Which figure it makes; 4 is the paper's Fig. 4."""
    experiment: Literal["route_codes"]
    problem: Problem
    numerics: Numerics = Numerics()
