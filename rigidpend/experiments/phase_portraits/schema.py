"""The config of `experiment: phase_portraits`: orbits of the Euler case (Fig. 1)."""

import math
from typing import Annotated

from pydantic import Field

from rigidpend.config.bodies import UnweightedBody
from rigidpend.config.schema import ExperimentConfig, Number, Part, Whole, holding

Height = Annotated[
    Number, holding(lambda x: 0 < x < 1, "a height |M3|/|M| is more than 0 and less than 1")
]
Elevation = Annotated[
    Number, holding(lambda x: abs(x) <= math.pi / 2, "an elevation is from -pi/2 to pi/2")
]


class View(Part):
    """Direction from which the sphere is seen; M3 points upwards."""

    azimuth: Number
    """Azimuth of the viewer, radians, from the axis of M1 towards that of M2."""
    elevation: Elevation
    """Elevation of the viewer, radians, from the plane of M1 and M2 towards M3."""


class Problem(UnweightedBody):
    """Orbits of given heights around the axes of M1 and of M2, and the separatrix."""

    heights: Annotated[tuple[Height, ...], Field(min_length=1, max_length=100)]
    """Largest |M3|/|M| of each orbit, dimensionless, between 0 (centre) and 1 (separatrix)."""
    points: Annotated[Whole, Field(ge=9, le=10_000)] = 241
    """Number of points on each orbit and on each separatrix."""
    view: View


class Config(ExperimentConfig):
    problem: Problem
