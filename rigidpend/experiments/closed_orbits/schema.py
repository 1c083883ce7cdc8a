"""The config of `experiment: closed_orbits`: periodic orbits by their words."""

from typing import Annotated

from pydantic import Field

from rigidpend.config.bodies import BodyAtEnergy
from rigidpend.config.schema import ExperimentConfig, Whole


class Problem(BodyAtEnergy):
    """A heavy body, and the words that its closed orbits repeat."""

    half_turns: Annotated[Whole, Field(ge=1, le=1000)]
    """Half rotations of every passage; fewer of them stretch less."""
    longest: Annotated[Whole, Field(ge=1, le=10)]
    """Symbols of the longest words."""
    verified: Annotated[Whole, Field(ge=0, le=10)]
    """Symbols of the longest words whose orbits are integrated in 113 bits."""
    symbols: Annotated[Whole, Field(ge=100, le=10_000)]
    """Symbols of the long orbit with which averages over closed orbits are compared."""


class Config(ExperimentConfig):
    problem: Problem
