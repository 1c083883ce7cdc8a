"""The config of `experiment: heteroclinic_cycle`: the graph of the separatrices (Fig. 2)."""

from __future__ import annotations

from typing import Literal

from rigidpend.config.schema.base import Part
from rigidpend.config.schema.phase_portraits import FreeBody


class Problem(FreeBody):
    """The body whose separatrices are the vertical edges; without weight they are straight."""


class Config(Part):
    """A whole config."""

    figure: str
    """Which figure it makes; 2 is the paper's Fig. 2."""
    experiment: Literal["heteroclinic_cycle"]
    problem: Problem
