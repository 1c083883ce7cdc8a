"""The config of `experiment: route_zoom`: route codes around a change of symbol."""

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from rigidpend.config.bodies import RouteStart
from rigidpend.config.schema import ExperimentConfig, Number, Numerics, Whole, holding
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact

FINEST = -200
"""Least decadic exponent of a step, radians: smaller deviations are lost in doubles."""

LONGEST = 40
"""Most characters of the factor as a quotient, whose powers are written out in every phase.

Results and certificates store the factor as a quotient, and are read under the same limit."""


class Problem(RouteStart):
    """Arrays of ever finer phases around an orbit at which a symbol changes."""

    between: tuple[Number, Number]
    """Two phases theta2_0, radians, at which the symbol differs and those before it are equal.

    The smaller one comes first."""
    symbol: Annotated[Whole, Field(ge=1)] = 1
    """Number of the symbol that changes."""
    step: Annotated[Number, holding(lambda x: x > 0, "step must be greater than 0")]
    """Spacing of the columns at the first level, radians."""
    factor: Number = exact(100)
    """Factor by which each level is finer than the one before, dimensionless, 2 to 1000000.

    The picture repeats if it is the multiplier of the periodic orbit, which `describe` prints."""
    levels: Annotated[Whole, Field(ge=1, le=60)]
    """Number of arrays."""
    count: Annotated[Whole, Field(ge=3, le=999)]
    """Number of columns of an array."""

    @model_validator(mode="after")
    def _physics(self) -> Self:
        if not float(self.mu) > 0:
            raise ParameterError(
                "mu", "without a weight no orbit returns, no symbol changes: mu > 0"
            )
        if self.symbol > self.n_symbols:
            raise ParameterError(
                "symbol", f"symbol {self.symbol} is beyond n_symbols = {self.n_symbols}"
            )
        first, second = self.between
        if not float(second - first) > 0:
            raise ParameterError(
                "between", f"expected two phases, the smaller one first, got {first} and {second}"
            )
        quotient = str(self.factor.fraction or self.factor)
        if not 2 <= float(self.factor) <= 1e6 or len(quotient) > LONGEST:
            said = (
                f"factor must be from 2 to 1000000, in at most {LONGEST} characters as a quotient"
            )
            raise ParameterError("factor", f"{said}, got {self.factor}")
        finest = math.log10(float(self.step)) - (self.levels - 1) * math.log10(float(self.factor))
        if finest < FINEST:
            raise ParameterError(
                "levels", f"the last level's step would be 1e{finest:.0f}, below 1e{FINEST}"
            )
        self.routes.afford(self.levels * self.count, "levels")
        return self


class Config(ExperimentConfig):
    problem: Problem
    numerics: Numerics = Numerics()
