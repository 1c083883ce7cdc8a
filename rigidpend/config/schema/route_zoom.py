"""The config of `experiment: route_zoom`: route codes around a change of symbol."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rigidpend.config.schema.base import HeavyBody, Number, Numerics, Part, Whole, physics


class Problem(HeavyBody):
    """Arrays of ever finer phases around an orbit at which a symbol changes."""

    h0: Number
    """Energy constant, h0 > mu."""
    J1_0: Number
    """Initial action, dimensionless, 0 < J1_0 < J2_0, not J2_0/2."""
    n_symbols: Whole = 15
    """Symbols on each orbit."""
    between: tuple[Number, Number]
    """Two phases theta2_0, rad, at which the symbol differs and those before it are equal."""
    symbol: Annotated[Whole, Field(ge=1)] = 1
    """Which symbol changes."""
    step: Number
    """Spacing of the columns at the first level, rad."""
    factor: Annotated[Whole, Field(ge=2, le=10**6)] = 100
    """By which each level is finer than the one before."""
    levels: Annotated[Whole, Field(ge=1, le=60)]
    """How many arrays."""
    count: Annotated[Whole, Field(ge=3, le=999)]
    """Columns of an array."""

    @model_validator(mode="after")
    def _physics(self) -> Self:
        from rigidpend.routes.problem import RouteProblem

        if self.symbol > self.n_symbols:
            raise ValueError(f"symbol {self.symbol} is beyond n_symbols = {self.n_symbols}")
        if not float(self.step) > 0:
            raise ValueError(f"step must be greater than 0, got {self.step}")
        with physics():
            RouteProblem(self.body, self.h0, self.J1_0, self.n_symbols)
        return self


class Config(Part):
    """A whole config."""

    figure: str
    """Which figure it makes."""
    experiment: Literal["route_zoom"]
    problem: Problem
    numerics: Numerics = Numerics()
