"""The config of `experiment: route_map`: codes over a plane of two parameters."""

from collections.abc import Iterator
from itertools import product
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from rigidpend.config.bodies import Axis, Range, RouteStart, distinct
from rigidpend.config.schema import Auto, ExperimentConfig, Number, Numerics, Part, Whole, Word
from rigidpend.machine import files
from rigidpend.numbers.checked import ParameterError


class PlaneAxis(Axis):
    """An axis of the plane, with its parameter."""

    axis: Literal["theta2_0", "log10_J1_0", "mu", "h0", "beta0", "alpha0"]
    """Parameter that changes along the axis, alpha0 by A3."""


class Zoom(Part):
    """A part of the plane, shown with as many cells."""

    theta2_0: Auto[Range] = None
    """Ends on the axis across, if that is theta2_0; radians."""
    columns: Auto[Range] = None
    """Ends on the axis across, if columns are given; in units of its axis."""
    rows: Range
    """Ends on the axis upwards; in units of that axis."""


def _form(given: Any) -> str:
    return "cells" if isinstance(given, dict | Axis) else "phase"


Phase = Annotated[
    Annotated[Axis, Tag("cells")] | Annotated[Number, Tag("phase")], Discriminator(_form)
]


class Problem(RouteStart):
    """A plane of two parameters; the other parameters are the same for all cells."""

    n_symbols: Annotated[Whole, Field(ge=1, le=250)] = 15
    """Symbols on each orbit, at most 250."""
    theta2_0: Phase
    """Initial phases of the columns, radians; or one number, if columns are given."""
    columns: Auto[PlaneAxis] = None
    """The axis across; auto is the cells of theta2_0."""
    rows: PlaneAxis
    """The axis upwards. The drawing marks values that the problem gives for its axes."""
    zooms: Annotated[dict[Word, Zoom], Field(default_factory=dict)]
    """Named parts of the plane that are also shown."""

    @property
    def names(self) -> tuple[str, str]:
        """Names of the parameters across and upwards."""
        return self.columns.axis if self.columns else "theta2_0", self.rows.axis

    @property
    def planes(self) -> dict[str, tuple[Axis, Axis]]:
        """The axes of the whole plane, named "", and of its zooms."""
        across = self.columns or self.theta2_0
        assert isinstance(across, Axis)
        zooms = {
            name: (across.within(getattr(zoom, self._across)), self.rows.within(zoom.rows))
            for name, zoom in self.zooms.items()
        }
        return {"": (across, self.rows), **zooms}

    @property
    def _across(self) -> str:
        """The key of the axis across."""
        return "columns" if self.columns else "theta2_0"

    @model_validator(mode="after")
    def _plane(self) -> Self:
        for field, message in self._contradictions():
            raise ParameterError(field, message)
        cells = 0
        for name, axes in self.planes.items():
            for axis, field in zip(axes, (self._across, "rows"), strict=True):
                distinct(axis, f"zooms.{name}.{field}" if name else field)
            cells += axes[0].count * axes[1].count
            self._check_corners(axes, f"zooms.{name}." if name else "")
        what = f"{cells} cells of {self.n_symbols} symbols"
        files.afford(self._across, cells, self.n_symbols + 2, what)
        return self

    def _check_corners(self, axes: tuple[Axis, Axis], place: str) -> None:
        """Refuse ends of axes that the problem excludes, naming the key that gives them."""
        from rigidpend.routes.cells import cell_problem

        keys = dict(zip(self.names, (self._across, "rows"), strict=True))
        for corner in product(*(axis.ends for axis in axes)):
            try:
                cell_problem(self.routes, dict(zip(self.names, corner, strict=True)))
            except ParameterError as error:
                # alpha0 is reached by A3, which may make no body.
                name = {"J1_0": "log10_J1_0", "A": "alpha0"}.get(error.field, error.field)
                # h0 > mu is broken by h0 or mu: the error names the one that varies.
                name = "mu" if name == "h0" and name not in keys else name
                # The error names the ends alone: the number of cells is not at fault.
                ends = "" if place else ".ends"
                field = f"{place}{keys[name]}{ends}" if name in keys else error.field
                raise ParameterError(field, str(error)) from None

    def _contradictions(self) -> Iterator[tuple[str, str]]:
        """Fields that contradict others, each with its remedy."""
        across, upwards = self.names
        if across == upwards:
            message = f"columns and rows are both {across}: give columns another axis"
            yield "columns" if self.columns else "rows", message
        if self.columns and isinstance(self.theta2_0, Axis):
            message = f"columns are {across}: give theta2_0 as one number, radians"
            yield "theta2_0", message
        if not self.columns and not isinstance(self.theta2_0, Axis):
            message = "theta2_0 is one number: give columns, or theta2_0 with ends and count"
            yield "theta2_0", message
        other = "theta2_0" if self.columns else "columns"
        for name, zoom in self.zooms.items():
            if getattr(zoom, self._across) is None or getattr(zoom, other) is not None:
                message = f"a zoom of this plane has {self._across} and rows, its ends, not {other}"
                yield f"zooms.{name}", message


class Config(ExperimentConfig):
    problem: Problem
    numerics: Numerics = Numerics()
