"""The config of `experiment: precession`: increments of theta3 along the separatrices."""

from typing import Self

from pydantic import model_validator

from rigidpend.config.bodies import WeightedBodies, check_drawn
from rigidpend.config.schema import DoubleNumerics, ExperimentConfig, Number


class Problem(WeightedBodies):
    """Heteroclinic orbits of all separatrices, each integrated from end to end."""

    drawn: Number
    """Weight at which increments are shown beside the first order, one of mu; physical units."""

    @model_validator(mode="after")
    def _known(self) -> Self:
        check_drawn("mu", self.drawn, self.mu)
        return self


class Config(ExperimentConfig):
    problem: Problem
    numerics: DoubleNumerics = DoubleNumerics()
