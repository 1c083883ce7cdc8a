"""The config of `experiment: splitting`: the distance of S1- and S2+, true and by Melnikov."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rigidpend.config.bodies import WeightedBodies, check_drawn
from rigidpend.config.schema import ExperimentConfig, Numerics, Whole, Word


class Problem(WeightedBodies):
    """Distances on the section J1 = J2/2, as functions of g = theta1/2 + theta2."""

    drawn: Word
    """Name of the body whose distance is stored at all phases."""
    phases: Annotated[Whole, Field(ge=9, le=10_000)] = 73
    """Number of phases g from -pi to pi, both included."""

    @model_validator(mode="after")
    def _known(self) -> Self:
        check_drawn("body", self.drawn, self.bodies)
        return self


class Config(ExperimentConfig):
    problem: Problem
    numerics: Numerics = Numerics()
