"""The config of `experiment: route_map`: codes over initial phases and another parameter."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rigidpend.config.bodies import Axis, Range, RouteStart, distinct
from rigidpend.config.schema import ExperimentConfig, Numerics, Part, Word
from rigidpend.machine import files
from rigidpend.numbers.checked import ParameterError


class PlaneAxis(Axis):
    """The axis upwards, with what it is."""

    axis: Literal["log10_J1_0", "mu", "h0", "beta0", "alpha0"]
    """Parameter that changes along the axis, alpha0 by A3."""


class Zoom(Part):
    """A part of the plane, shown with as many cells."""

    theta2_0: Range
    """Its ends across, radians."""
    rows: Range
    """Its ends upwards; in units of that axis."""


class Problem(RouteStart):
    """A plane of initial phases and another parameter; the rest is common to all."""

    theta2_0: Axis
    """Initial phases, radians: the cells across."""
    rows: PlaneAxis
    """The axis upwards. The value given for it above is marked in the drawing."""
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
        cells = 0
        for name, axes in self.planes.items():
            place = f"zooms.{name}." if name else ""
            for axis, field in zip(axes, ("theta2_0", "rows"), strict=True):
                distinct(axis, f"{place}{field}")
            cells += axes[0].count * axes[1].count
            self._check_ends(axes[1], place)
        what = f"{cells} cells of {self.n_symbols} symbols"
        files.afford("theta2_0", cells, self.n_symbols + 2, what)
        return self

    def _check_ends(self, rows: Axis, place: str) -> None:
        """Refuse ends that the problem excludes, where they are written."""
        from rigidpend.routes.cells import cell_problem

        for end in rows.ends:
            try:
                cell_problem(self.routes, {self.rows.axis: end})
            except ParameterError as error:
                raise ParameterError(f"{place}rows", str(error)) from None


class Config(ExperimentConfig):
    """A whole config of this experiment."""

    problem: Problem
    numerics: Numerics = Numerics()
