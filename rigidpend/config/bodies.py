"""Bodies, starts and axes in configs: bodies with a weight or without, or several in turn."""

from __future__ import annotations

import functools
import math
from collections.abc import Collection
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeAlias

from pydantic import AfterValidator, Field, model_validator

from rigidpend.config.schema import Direction, Moments, Number, Part, Weight, Whole, Word
from rigidpend.mechanics.body import Body
from rigidpend.numbers import Array
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import Exact

if TYPE_CHECKING:
    from rigidpend.routes.problem import RouteProblem


class UnweightedBody(Part):
    """A body whose weight is zero or given elsewhere."""

    A: Moments
    """Principal moments of inertia, A1 > A3 > A2 and A2 + A3 >= A1; physical units."""
    r: Direction
    """Direction to the centre of gravity, r1, r2 >= 0, r3 = 0; normalised."""

    def heavy(self, mu: Exact | int) -> Body:
        """Make the body with a weight."""
        return Body(self.A, self.r, mu)

    @functools.cached_property
    def body(self) -> Body:
        return self.heavy(0)

    @model_validator(mode="after")
    def _conditions(self) -> Self:
        # Body itself checks the conditions that join fields: making one repeats none of them here.
        _ = self.body
        return self


class HeavyBody(UnweightedBody):
    """A heavy body with its weight."""

    mu: Weight
    """Weight times the distance of the centre of gravity, mu >= 0; physical units."""

    @functools.cached_property
    def body(self) -> Body:
        return self.heavy(self.mu)

    @property
    def words(self) -> str:
        """The body, its energy and action, as far as they are given: what a sentence is of."""
        A, r = (", ".join(map(str, x)) for x in (self.A, self.r))
        others = {key: getattr(self, key, None) for key in ("mu", "h", "h0", "J1_0")}
        given: dict[str, Any] = {"A": A, "r": r, **others}
        return "; ".join(f"{key} = {value}" for key, value in given.items() if value is not None)


class BodyAtEnergy(HeavyBody):
    """A heavy body, and the energy of all orbits."""

    h: Number
    """Energy of all orbits (eq. h0_new), h > mu; physical units, as mu."""

    @model_validator(mode="after")
    def _rotates(self) -> Self:
        from rigidpend.routes.problem import check_energy

        check_energy("h", self.h, self.mu)
        return self


class RouteStart(HeavyBody):
    """Orbits that start at theta1_0 = alpha0 + beta0 and J2_0 = sqrt(2 h0/kappa)."""

    h0: Number
    """Energy constant, h0 > mu; physical units, as mu."""
    J1_0: Number
    """Initial action, dimensionless, 0 < J1_0 < J2_0, not J2_0/2."""
    n_symbols: Whole = 15
    """Symbols on each orbit."""

    @functools.cached_property
    def routes(self) -> RouteProblem:
        """The checked problem of route codes with this start."""
        from rigidpend.routes.problem import RouteProblem

        return RouteProblem(self.body, self.h0, self.J1_0, self.n_symbols)

    @model_validator(mode="after")
    def _start(self) -> Self:
        _ = self.routes
        return self


def check_drawn(what: str, value: Any, known: Collection[Any]) -> None:
    """Refuse a choice of what is drawn that is not among what the config gives."""
    if value not in known:
        said = ", ".join(map(str, known))
        raise ParameterError("drawn", f"no such {what}: {value} (known: {said})")


def _ascending(values: tuple[Exact, ...]) -> tuple[Exact, ...]:
    if not float(values[0]) > 0:
        raise ValueError(f"mu must be more than 0, got {values[0]}")
    if not all(float(low) < float(high) for low, high in pairwise(values)):
        raise ValueError(f"mu must ascend, got {', '.join(map(str, values))}")
    return values


Weights = Annotated[
    tuple[Number, ...], Field(min_length=2, max_length=100), AfterValidator(_ascending)
]


class WeightedBodies(Part):
    """Bodies at one energy, each with every weight."""

    h0: Number
    """Energy of the orbits, h0 > mu; physical units, as mu."""
    mu: Weights
    """Weights times the distance of the centre of gravity, ascending, above 0, physical."""
    bodies: Annotated[dict[Word, UnweightedBody], Field(min_length=1, max_length=26)]
    """Named bodies; physical units."""

    @model_validator(mode="after")
    def _energy(self) -> Self:
        from rigidpend.routes.problem import LEAST_MU, check_energy

        check_energy("h0", self.h0, self.mu[-1])
        if not (self.mu[0] / self.h0).at(53) > LEAST_MU:
            message = f"mu = {self.mu[0]} is below {LEAST_MU} h0, too small for doubles"
            raise ParameterError("mu", message)
        return self


MOST_CELLS = 100_000
"""Largest number of cells along an axis."""
Range: TypeAlias = tuple[Number, Number]


class Axis(Part):
    """Adjacent cells of an axis between two ends."""

    ends: Range
    """The ends, ascending; radians, a decadic logarithm, or physical units for mu and h0."""
    count: Annotated[Whole, Field(ge=2, le=MOST_CELLS)]
    """Number of cells; each is computed at its middle."""

    def within(self, ends: Range) -> Axis:
        """The same number of cells between other ends."""
        return Axis.model_construct(ends=ends, count=self.count)

    @property
    def values(self) -> Array:
        """The middles of the cells, as doubles."""
        import numpy as np

        low, high = map(float, self.ends)
        return low + (high - low) * (np.arange(self.count) + 0.5) / self.count

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        distinct(self, "ends")
        return self


def distinct(axis: Axis, field: str) -> None:
    """Refuse an axis with cells that doubles cannot distinguish."""
    low, high = map(float, axis.ends)
    finest = 16 * math.ulp(max(abs(low), abs(high)))
    if not low < high:
        raise ParameterError(field, f"the ends must ascend, got {low} and {high}")
    if high - low < finest * axis.count:
        message = f"{axis.count} cells between {low!r} and {high!r} are too fine for doubles"
        raise ParameterError(field, message)
