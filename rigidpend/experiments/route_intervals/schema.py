"""The config of `experiment: route_intervals`: the line of Fig. 4's starts, cut into intervals."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rigidpend.config.bodies import RouteStart
from rigidpend.config.schema import ExperimentConfig, PhaseGrid, Whole
from rigidpend.numbers.checked import ParameterError

FIG4 = {"start": "0", "step": "1/10", "count": "63"}
"""Columns of Fig. 4's left array."""


class Problem(RouteStart):
    """Starts with all theta2_0 from 0 to 2 pi."""

    n_symbols: Annotated[Whole, Field(ge=1, le=8)] = 3
    """Largest number of symbols to be proven."""
    halvings: Annotated[Whole, Field(ge=1, le=20)] = 7
    """Largest number of times that the line is halved, to intervals of 2 pi/2^halvings."""
    columns: PhaseGrid = PhaseGrid.model_validate(FIG4)
    """Single starts theta2_0 that are integrated and drawn above: Fig. 4's left array."""

    @model_validator(mode="after")
    def _rational(self) -> Self:
        if self.J1_0.fraction is None:
            raise ParameterError("J1_0", f"expected a decimal or fraction, got {self.J1_0}")
        if not float(self.mu) > 0:
            raise ParameterError("mu", "without a weight no orbit leaves a surface: mu > 0")
        return self


class Config(ExperimentConfig):
    problem: Problem
