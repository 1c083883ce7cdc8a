"""The config of `experiment: phase_portraits`: orbits of the Euler case (Fig. 1)."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from rigidpend.config.bodies import FreeBody
from rigidpend.config.schema import ExperimentConfig, Number, Part, Whole
from rigidpend.numbers.exact import PI, Exact


def _height(x: Exact) -> Exact:
    if not 0 < float(x) < 1:
        raise ValueError(f"a height |M3|/|M| is more than 0 and less than 1, got {x}")
    return x


def _elevation(x: Exact) -> Exact:
    if not abs(float(x)) <= float(PI) / 2:
        raise ValueError(f"an elevation is from -pi/2 to pi/2, got {x}")
    return x


class View(Part):
    """Direction from which the sphere is seen; M3 points upwards."""

    azimuth: Number
    """Azimuth of the viewer, radians, from the axis of M1 towards that of M2."""
    elevation: Annotated[Number, AfterValidator(_elevation)]
    """Elevation of the viewer, radians, from the plane of M1 and M2 towards M3."""


class Problem(FreeBody):
    """Orbits of given heights around the axes of M1 and of M2, and the separatrix."""

    heights: Annotated[
        tuple[Annotated[Number, AfterValidator(_height)], ...], Field(min_length=1, max_length=100)
    ]
    """Largest |M3|/|M| of each orbit, dimensionless, between 0 (centre) and 1 (separatrix)."""
    points: Annotated[Whole, Field(ge=9, le=10_000)] = 241
    """Number of points on each orbit and on each separatrix."""
    view: View


class Config(ExperimentConfig):
    """A whole config of this experiment."""

    problem: Problem
