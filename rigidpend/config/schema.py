"""Shared parts of the experiments' schemas: numbers, bodies, grids of phases, numerics.

A config has two parts: `problem` says what is computed, `numerics` how accurately. Numbers are
exact, as written. Unknown keys are errors, and a schema declares only what its experiment reads.
"""

from __future__ import annotations

import ast
import functools
import inspect
import math
import re
import textwrap
from collections.abc import Callable
from itertools import pairwise
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    Self,
    TypeVar,
    Union,
    get_args,
    get_origin,
)

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    SerializationInfo,
    StringConstraints,
    WrapSerializer,
    model_validator,
)

from rigidpend.config.complaints import meant
from rigidpend.mechanics.body import Body
from rigidpend.numbers import checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import FINEST_BITS, PRECISIONS, Exact, exact

if TYPE_CHECKING:
    from rigidpend.routes.phases import Grid

ENGINES = ("auto", "taylor", "scipy")
"""Words for an engine in a config."""
WRITTEN = "as written"
"""Context of a dump with numbers and words as a person writes them."""
LARGEST_NUMBER = 10**15
"""Largest magnitude of whole numbers and phases, so that doubles still distinguish neighbours."""


def _number(value: Any) -> Exact:
    # The reader leaves numbers as texts: a float here would have been rounded on its way.
    if not isinstance(value, str) or not value:
        raise ValueError("expected a number, such as 0.1, 1e-6, 1/10 or 3*pi/40")
    number = exact(value)
    # What is undefined up to rounding, such as tan(pi/2), is refused here, with its place.
    float(number)
    return number


def _whole(value: Any) -> int:
    number = _number(value).fraction
    if number is None or number.denominator != 1:
        raise ValueError(f"{value} is not a whole number")
    if abs(number) > LARGEST_NUMBER:
        raise ValueError(f"{value} is too large")
    return int(number)


def _engine(value: Any) -> Any:
    if value is not None and value not in ENGINES:
        known = f"{', '.join(ENGINES[:-1])} or {ENGINES[-1]}"
        raise ValueError(f"expected {known}, got {value!r}{meant(str(value), ENGINES)}")
    return value


def _canonical(x: Exact, info: SerializationInfo) -> str:
    """Text of a number: as written in the context `WRITTEN`.

    Otherwise equal rational numbers have the same text, however they were written.
    """
    if info.context == WRITTEN:
        return x.text
    # A quotient in lowest terms; Python writes no integers of more than 4300 digits.
    if x.fraction is None or max(map(int.bit_length, x.fraction.as_integer_ratio())) > 10_000:
        return x.text
    return str(x.fraction)


def holding(allowed: Callable[[float], bool], said: str) -> AfterValidator:
    """Validator of a number by a condition on its double, with the message for other numbers."""

    def held(x: Exact) -> Exact:
        if not allowed(double := float(x)):
            plain = str(x) in (f"{double:g}", repr(double))
            rounded = "" if plain else f", {double!r} in doubles"
            raise ValueError(f"{said}, got {x}{rounded}")
        return x

    return AfterValidator(held)


def _of_body(name: str) -> AfterValidator:
    """Validator of one field of a body, by a body whose other fields are valid."""

    def held(x: Any) -> Any:
        Body(**{**_ANY_BODY, name: x})
        return x

    return AfterValidator(held)


_ANY_BODY: Any = {"A": (2, 1, "3/2"), "r": (1, 0, 0), "mu": 0}


Number = Annotated[Exact, BeforeValidator(_number), PlainSerializer(_canonical)]
Whole = Annotated[int, BeforeValidator(_whole)]
Count = Annotated[Whole, Field(ge=1, le=10**7)]
Triple = tuple[Number, Number, Number]
# Checked field by field, so that all broken conditions on single fields are reported at once.
TOLERANCE = holding(lambda x: 0 < x <= 1e-2, "tolerance must be more than 0 and at most 0.01")
Moments = Annotated[Triple, _of_body("A")]
Direction = Annotated[Triple, _of_body("r")]
Weight = Annotated[Number, _of_body("mu")]
Word = Annotated[str, StringConstraints(pattern=r"^[A-Za-z]\w*$", max_length=40)]


def word_for_none(word: str) -> tuple[BeforeValidator, WrapSerializer]:
    """Validator and serializer for a word that stands for None in a config."""

    def written(value: Any, others: Callable[[Any], Any], info: SerializationInfo) -> Any:
        return word if value is None and info.context == WRITTEN else others(value)

    return BeforeValidator(lambda value: None if value == word else value), WrapSerializer(written)


Kind = TypeVar("Kind")
Auto = Annotated[Kind | None, *word_for_none("auto")]
"""A value, or None, which a config writes as auto."""


class Part(BaseModel):
    """A part of a config: frozen, without unknown keys; the text under a key is its meaning."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        arbitrary_types_allowed=True,
        defer_build=True,
    )


def comment(part: type[BaseModel], name: str) -> str:
    """Meaning of a key with its unit, as a phrase; empty if the schema has none."""
    owner = next(x for x in part.__mro__ if name in inspect.get_annotations(x))
    return " ".join(_texts(owner).get(name, "").replace("\\|", "|").split()).rstrip(".")


@functools.cache
def _texts(part: type) -> dict[str, str]:
    """The texts under the keys of a part, read when they are asked for.

    Pydantic would read them of all classes wherever one is defined: a third of `rigidpend list`.
    """
    [tree] = ast.parse(textwrap.dedent(inspect.getsource(part))).body
    return {
        key.target.id: str(below.value.value)
        for key, below in pairwise(ast.iter_child_nodes(tree))
        if isinstance(key, ast.AnnAssign) and isinstance(key.target, ast.Name)
        if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
    }


def nested(annotation: Any) -> tuple[type[BaseModel] | None, bool]:
    """The part of a config in an annotation, or None; and True if there are several, by name."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return nested(get_args(annotation)[0])
    if origin is dict:
        return nested(get_args(annotation)[1])[0], True
    if origin in (Union, UnionType):
        # For a section or an alternative the section counts.
        return next((x for x in map(nested, get_args(annotation)) if x[0]), (None, False))
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        return annotation, False
    return None, False


class PhaseGrid(Part):
    """Phases start + k step, k = 0 .. count - 1, in radians."""

    start: Number
    """The first phase, radians."""
    step: Number
    """Distance from each phase to the next, radians."""
    count: Annotated[Whole, Field(ge=1, le=checked.MOST_PHASES)]
    """Number of phases."""

    @property
    def phases(self) -> Grid:
        """Phases of the grid, each made when it is needed."""
        from rigidpend.routes.phases import Grid

        return Grid(self.start, self.step, self.count)

    @model_validator(mode="after")
    def _range(self) -> Self:
        for field, reach in (("start", self.start), ("step", self.step * self.count)):
            if not abs(float(reach)) < LARGEST_NUMBER:
                message = f"phases beyond {LARGEST_NUMBER:.0e} cannot be resolved in doubles"
                raise ParameterError(field, message)
        self.apart(FINEST_BITS)
        return self

    def apart(self, bits: int) -> None:
        """Refuse phases that are equal in a precision: a step of 0, or one lost in rounding."""
        step = abs(float(self.step))
        # A grid that reaches far beyond its start has steps that no precision loses there. By
        # ldexp, because 2.0**-bits vanishes below 2^-1074.
        if self.count > 1 and not step > math.ldexp(abs(float(self.start)), -bits):
            lost = f"equal in {bits} bits" if step else "equal in doubles"
            message = f"the step {self.step} makes {self.count} columns {lost}: take a larger one"
            raise ParameterError("step", message)


class DoubleNumerics(Part):
    """Numerics of experiments in double precision only."""

    engine: Annotated[Auto[Literal["taylor", "scipy"]], BeforeValidator(_engine)] = None
    """taylor, by a kernel compiled here, or scipy (DOP853); auto is taylor if LLVM is installed."""

    tolerance: Auto[Annotated[Number, TOLERANCE]] = None
    """Local tolerance in double precision, dimensionless; auto is the engine's own."""


class Numerics(DoubleNumerics):
    """Numerics of experiments that use more bits where necessary."""

    precisions: Annotated[tuple[Whole, ...], AfterValidator(checked.precisions)] = PRECISIONS
    """Working precisions in bits, ascending; a column with an uncertain symbol goes to the next."""


class ExperimentConfig(Part):
    """A whole config; each experiment's `Config` adds its `problem`, and `numerics` if any."""

    figure: Annotated[str, StringConstraints(max_length=100)] = ""
    """Name of the figure it makes, if it has one; a number is the paper's."""
    experiment: str
    """The name of the experiment."""
    problem: Part
    """Parameters of the computation."""

    @property
    def of_the_paper(self) -> bool:
        """True if the config names a figure of the paper, which begins with a number."""
        return re.fullmatch(r"\d+(, \w+)?", self.figure) is not None

    @property
    def numerics_asked(self) -> dict[str, Any]:
        """Engine, tolerance and precisions that the config asks for, as far as it has them."""
        numerics = getattr(self, "numerics", None)
        declared = Numerics.model_fields
        return {name: getattr(numerics, name) for name in declared if hasattr(numerics, name)}
