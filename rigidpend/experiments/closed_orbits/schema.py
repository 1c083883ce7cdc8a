"""The config of `experiment: closed_orbits`: periodic orbits by their words."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from rigidpend.config.bodies import HeavyBody
from rigidpend.config.schema import ExperimentConfig, Number, Whole
from rigidpend.routes.problem import check_energy


class Problem(HeavyBody):
    """A heavy body, and the words that its closed orbits repeat."""

    h: Number
    """Energy of all orbits (eq. h0_new), h > mu; physical units, as mu."""
    half_turns: Annotated[Whole, Field(ge=1, le=1000)]
    """Half rotations of every passage; fewer of them stretch less."""
    longest: Annotated[Whole, Field(ge=1, le=10)]
    """Symbols of the longest words."""
    verified: Annotated[Whole, Field(ge=0, le=10)]
    """Symbols of the longest words whose orbits are integrated in 113 bits."""
    symbols: Annotated[Whole, Field(ge=100, le=10_000)]
    """Symbols of the long orbit with which averages over closed orbits are compared."""

    @model_validator(mode="after")
    def _rotates(self) -> Self:
        check_energy("h", self.h, self.mu)
        return self


class Config(ExperimentConfig):
    problem: Problem
