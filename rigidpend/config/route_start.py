"""The start of orbits on S1- in configs."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Self

from pydantic import model_validator

from rigidpend.config.bodies import HeavyBody
from rigidpend.config.schema import Number, Whole, physics

if TYPE_CHECKING:
    from rigidpend.routes.problem import RouteProblem


class RouteStart(HeavyBody):
    """Orbits that start at theta1_0 = alpha0 + beta0 and J2_0 = sqrt(2 h0/kappa)."""

    h0: Number
    """Energy constant, h0 > mu, dimensionless."""
    J1_0: Number
    """Initial action, dimensionless, 0 < J1_0 < J2_0, not J2_0/2."""
    n_symbols: Whole = 15
    """Symbols on each orbit."""

    @functools.cached_property
    def routes(self) -> RouteProblem:
        """Checked start, as the route codes take it."""
        from rigidpend.routes.problem import RouteProblem

        return RouteProblem(self.body, self.h0, self.J1_0, self.n_symbols)

    def afford(self, columns: int, field: str) -> None:
        """Refuse more columns, each of so many symbols, than a result can hold."""
        with physics():
            self.routes.afford(columns, field)

    @model_validator(mode="after")
    def _start(self) -> Self:
        with physics():
            _ = self.routes
        return self
