"""The config of `experiment: precession`: increments of theta3 along the separatrices."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from rigidpend.config.bodies import WeightedBodies
from rigidpend.config.schema import DoubleNumerics, ExperimentConfig, Number, physics


class Problem(WeightedBodies):
    """Heteroclinic orbits of all separatrices, each integrated from end to end."""

    drawn: Number
    """Weight mu, physical, at which increments are shown beside the first order; of the list."""

    @model_validator(mode="after")
    def _known(self) -> Self:
        from rigidpend.routes.problem import ProblemError

        with physics():
            if self.drawn not in self.mu:
                known = ", ".join(map(str, self.mu))
                raise ProblemError("drawn", f"no such mu: {self.drawn} (known: {known})")
        return self


class Config(ExperimentConfig):
    """A whole config of this experiment."""

    experiment: Literal["precession"]
    problem: Problem
    numerics: DoubleNumerics = DoubleNumerics()
