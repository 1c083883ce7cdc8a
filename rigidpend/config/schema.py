"""What a config may hold: every field with its meaning, default and unit.

A config has two parts: `problem` says what is computed, `numerics` how well. Numbers are kept
exact, as written. Unknown keys are errors.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    StringConstraints,
    model_validator,
)
from pydantic_core import PydanticCustomError

from rigidpend.body import Body, BodyError
from rigidpend.exact import Exact, exact

MAX_COLUMNS = 10_000_000


def _number(value: Any) -> Exact:
    if not isinstance(value, str):
        raise ValueError("expected a number, such as 0.1, 1e-6, 1/10 or 3*pi/40")
    return exact(value)


def _whole(value: Any) -> int:
    number = _number(value).fraction
    if number is None or number.denominator != 1:
        raise ValueError(f"{value} is not a whole number")
    return int(number)


def _automatic(value: Any) -> Any:
    return None if value == "auto" else value


def _canonical(x: Exact) -> str:
    """A text that is the same for the same rational number, however written."""
    return x.text if x.fraction is None else str(x.fraction)


def _tolerance(x: Exact) -> Exact:
    if not 0 < float(x) <= 1e-2:
        raise ValueError(f"tolerance must be more than 0 and at most 0.01, got {x}")
    return x


def _ladder(bits: tuple[int, ...]) -> tuple[int, ...]:
    if bits[0] < 53 or bits[-1] > 10_000 or not all(a < b for a, b in pairwise(bits)):
        raise ValueError(f"precisions must ascend from 53 bits to 10000 at most, got {bits}")
    return bits


Number = Annotated[Exact, BeforeValidator(_number), PlainSerializer(_canonical)]
Whole = Annotated[int, BeforeValidator(_whole)]
Word = Annotated[str, StringConstraints(pattern=r"^[A-Za-z]\w*$", max_length=40)]
Auto = BeforeValidator(_automatic)


class _Part(BaseModel):
    """A part of a config: frozen, and nothing in it that is not known."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)


class Grid(_Part):
    """Phases start + k step, k = 0 .. count - 1, in radians."""

    start: Number
    step: Number
    count: Annotated[Whole, Field(ge=1, le=MAX_COLUMNS)]


class RouteCodesProblem(_Part):
    """The problem of `experiment: route_codes`: orbits on S1- and their symbols."""

    A: tuple[Number, Number, Number]
    """Principal moments of inertia, A1 > A3 > A2 and A2 + A3 >= A1."""
    r: tuple[Number, Number, Number]
    """Direction to the centre of gravity, r1, r2 >= 0, r3 = 0; normalised."""
    mu: Number
    """Weight times the distance of the centre of gravity, mu >= 0."""
    h0: Number
    """Energy constant, h0 > mu."""
    J1_0: Number
    """Initial action, dimensionless, 0 < J1_0 < J2_0."""
    n_symbols: Whole = 15
    """Symbols on each orbit."""
    arrays: Annotated[dict[Word, Grid], Field(min_length=1)]
    """Named sets of initial phases theta2_0."""

    @property
    def body(self) -> Body:
        return Body(self.A, self.r, self.mu)

    @model_validator(mode="after")
    def _physics(self) -> RouteCodesProblem:
        from rigidpend.routes.problem import ProblemError, RouteProblem

        try:
            RouteProblem(self.body, self.h0, self.J1_0, self.n_symbols)
        except (BodyError, ProblemError) as error:
            known = {"field": error.field, "message": str(error)}
            raise PydanticCustomError("physics", "{message}", known) from None
        return self


class Numerics(_Part):
    """How well it is computed."""

    engine: Annotated[Literal["taylor", "scipy"] | None, Auto] = None
    """taylor (heyoka) or scipy; auto is taylor where it is installed."""
    tolerance: Annotated[Annotated[Number, AfterValidator(_tolerance)] | None, Auto] = None
    """Local tolerance in double precision; auto is the engine's own."""
    precisions: Annotated[tuple[Whole, ...], Field(min_length=1), AfterValidator(_ladder)] = (
        53,
        64,
        113,
    )
    """Bits, ascending; a column with an uncertain symbol goes to the next."""


class RouteCodesConfig(_Part):
    """A whole config of `experiment: route_codes`."""

    figure: str
    """Which figure it makes; 4 is the paper's Fig. 4."""
    experiment: Literal["route_codes"]
    problem: RouteCodesProblem
    numerics: Numerics = Numerics()


SCHEMAS: dict[str, type[_Part]] = {"route_codes": RouteCodesConfig}
"""The schema of each experiment."""
