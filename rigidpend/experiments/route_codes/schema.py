"""The config of `experiment: route_codes`: orbits on S1- and their symbols (Fig. 4)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from rigidpend.config.route_start import RouteStart
from rigidpend.config.schema import ExperimentConfig, Numerics, PhaseGrid, Word


class Problem(RouteStart):
    """Arrays of orbits that start side by side."""

    arrays: Annotated[dict[Word, PhaseGrid], Field(min_length=1)]
    """Named sets of initial phases theta2_0."""


class Config(ExperimentConfig):
    """A whole config of this experiment."""

    experiment: Literal["route_codes"]
    problem: Problem
    numerics: Numerics = Numerics()
