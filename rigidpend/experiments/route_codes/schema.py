"""The config of `experiment: route_codes`: orbits on S1- and their symbols (Fig. 4)."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rigidpend.config.bodies import RouteStart
from rigidpend.config.schema import ExperimentConfig, Numerics, PhaseGrid, Word
from rigidpend.numbers.checked import ParameterError


class Problem(RouteStart):
    """Arrays of orbits that start side by side."""

    arrays: Annotated[dict[Word, PhaseGrid], Field(min_length=1)]
    """Named sets of initial phases theta2_0."""

    @model_validator(mode="after")
    def _size(self) -> Self:
        self.routes.afford(sum(grid.count for grid in self.arrays.values()), "arrays")
        return self


class Config(ExperimentConfig):
    problem: Problem
    numerics: Numerics = Numerics()

    @model_validator(mode="after")
    def _apart(self) -> Self:
        for name, grid in self.problem.arrays.items():
            try:
                grid.apart(self.numerics.precisions[-1])
            except ParameterError as error:
                raise ParameterError(f"problem.arrays.{name}.step", str(error)) from None
        return self
