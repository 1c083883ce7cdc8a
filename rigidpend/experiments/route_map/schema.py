"""The config of `experiment: route_map`: codes over a plane of two parameters."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rigidpend.config.axes import Axis, Range, distinct
from rigidpend.config.route_start import RouteStart
from rigidpend.config.schema import ExperimentConfig, Numerics, Part, Word, afford, physics


class RowAxis(Axis):
    """The other axis, with what it is."""

    axis: Literal["log10_J1_0", "mu", "h0", "beta0", "alpha0"]
    """Parameter that changes from row to row (alpha0 by A3); along a row theta2_0 does."""


class Zoom(Part):
    """A part of the plane, shown with as many cells."""

    theta2_0: Range
    """Its ends, radians."""
    rows: Range
    """Its ends on the other axis."""


class Problem(RouteStart):
    """A plane of initial phases and of another parameter; the rest is common to all."""

    theta2_0: Axis
    """Initial phases, radians."""
    rows: RowAxis
    """The other axis. The value given for it above is marked in the drawing."""
    zooms: Annotated[dict[Word, Zoom], Field(default_factory=dict)]
    """Named parts of the plane that are shown as well."""

    @property
    def planes(self) -> dict[str, tuple[Axis, Axis]]:
        """The axes of the whole plane, named "", and of its zooms."""
        zooms = {
            name: (self.theta2_0.within(zoom.theta2_0), self.rows.within(zoom.rows))
            for name, zoom in self.zooms.items()
        }
        return {"": (self.theta2_0, self.rows), **zooms}

    @model_validator(mode="after")
    def _plane(self) -> Self:
        if self.n_symbols > 250:
            raise ValueError(f"n_symbols of a plane must be at most 250, got {self.n_symbols}")
        from rigidpend.routes.rows import row_problem

        cells = 0
        for name, axes in self.planes.items():
            for axis, field in zip(axes, ("theta2_0", "rows"), strict=True):
                distinct(axis, f"zooms.{name}.{field}" if name else field)
            cells += axes[0].count * axes[1].count
            with physics():
                for value in map(float, axes[1].ends):
                    row_problem(self.routes, self.rows.axis, value)
        afford("theta2_0", cells, self.n_symbols + 2, f"{cells} cells of {self.n_symbols} symbols")
        return self


class Config(ExperimentConfig):
    """A whole config of this experiment."""

    experiment: Literal["route_map"]
    problem: Problem
    numerics: Numerics = Numerics()
