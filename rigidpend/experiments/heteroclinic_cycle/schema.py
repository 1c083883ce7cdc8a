"""The config of `experiment: heteroclinic_cycle`: the graph of the separatrices (Fig. 2)."""

from __future__ import annotations

from rigidpend.config.bodies import FreeBody
from rigidpend.config.schema import ExperimentConfig


class Problem(FreeBody):
    """Body whose separatrices are the vertical edges; without weight they are straight."""


class Config(ExperimentConfig):
    problem: Problem
