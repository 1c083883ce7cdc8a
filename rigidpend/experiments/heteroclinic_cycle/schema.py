"""The config of `experiment: heteroclinic_cycle`: the graph of the separatrices (Fig. 2)."""

from rigidpend.config.bodies import UnweightedBody
from rigidpend.config.schema import ExperimentConfig


class Problem(UnweightedBody):
    """Body whose separatrices are the vertical edges; without weight they are straight."""


class Config(ExperimentConfig):
    problem: Problem
