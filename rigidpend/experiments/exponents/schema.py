"""The config of `experiment: exponents`: finite-time exponents over a plane of initial values."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rigidpend.config.bodies import Axis, RouteStart
from rigidpend.config.schema import ExperimentConfig, Numerics, Whole
from rigidpend.machine import files


class Problem(RouteStart):
    """A plane of initial phases and actions, and the number of passages of a deviation."""

    # Beyond so many passages roundings of doubles grow to the size of the result.
    n_symbols: Annotated[Whole, Field(ge=1, le=10)]
    """Symbols on each orbit, at most 10."""
    theta2_0: Axis
    """Initial phases, radians."""
    log10_J1_0: Axis
    """Decadic logarithms of the initial actions. J1_0 above is marked in the drawing."""
    checked: Annotated[Whole, Field(ge=0, le=10_000)]
    """Cells for which the variational equations are integrated as well."""

    @model_validator(mode="after")
    def _plane(self) -> Self:
        from rigidpend.routes.cells import cell_problem

        for value in self.log10_J1_0.ends:
            cell_problem(self.routes, {"log10_J1_0": value})
        cells = self.theta2_0.count * self.log10_J1_0.count
        what = f"{cells} cells of {self.n_symbols} symbols"
        files.afford("theta2_0", cells, self.n_symbols + 9, what)
        return self


class Config(ExperimentConfig):
    problem: Problem
    numerics: Numerics = Numerics()
