"""Descriptions: rows of name, value and meaning, as `describe` prints them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.free_body import separatrix_theta1
from rigidpend.numbers.exact import Exact

if TYPE_CHECKING:
    from rigidpend.config.schema import Part


class Row(NamedTuple):
    """A line of a description."""

    name: str
    value: str
    meaning: str
    number: float | Sequence[float] | None = None
    """The value as a number or list of numbers; None if it is neither."""


def number_row(name: str, meaning: str, *numbers: float | Exact) -> Row:
    """A row of one or several numbers: exact ones as written for people, doubles for programs."""
    # Adding 0.0 removes the sign of a negative zero.
    values = [x if isinstance(x, int) else float(x) + 0.0 for x in numbers]
    pairs = zip(numbers, values, strict=True)
    written = ", ".join(str(x) if isinstance(x, Exact) else repr(value) for x, value in pairs)
    # A single number stands for itself, so that programs need not unpack a list of one.
    return Row(name, written, meaning, values if values[1:] else values[0])


def asked(part: Part, apart: Sequence[str] = ()) -> Iterator[Row]:
    """A row for each key of a part of a config: its value as written, its meaning and unit.

    A section without a meaning of its own has a row for each of its keys; keys `apart` have none.
    """
    from rigidpend.config.schema import WRITTEN, comment, nested

    written = part.model_dump(mode="json", context=WRITTEN)
    for name in (name for name in type(part).model_fields if name not in apart):
        value, meaning = getattr(part, name), comment(type(part), name)
        numbers = value if isinstance(value, tuple) else (value,)
        if isinstance(value, Mapping):
            yield from (Row(f"{name} {key}", _text(x), meaning) for key, x in written[name].items())
        elif not meaning and nested(type(value))[0]:
            yield from (row._replace(name=f"{name} {row.name}") for row in asked(value))
        elif all(type(x) is int or isinstance(x, Exact) for x in numbers):
            yield number_row(name, meaning, *numbers)
        else:
            yield Row(name, _text(written[name]), meaning)


def _text(written: Any) -> str:
    """A value in one line."""
    if isinstance(written, Mapping):
        return ", ".join(f"{key} = {_text(x)}" for key, x in written.items())
    return ", ".join(map(_text, written)) if isinstance(written, list) else str(written)


def derived_rows(body: Body) -> list[Row]:
    """Rows of quantities that follow from a body's parameters."""
    special = ", ".join(body.special_cases) or "none"
    theta1 = separatrix_theta1(body.alpha0, body.beta0)
    return [
        number_row("alpha0", "rad", body.alpha0),
        number_row("beta0", "rad", body.beta0),
        number_row("gamma0", "rad", body.gamma0),
        number_row("kappa", "A1 A2/(A3 (A1 - A2))", body.kappa),
        number_row("nu", "pi kappa/sin(alpha0)", body.nu),
        number_row("separatrices", "rad, theta1 of 1, 2, 3, 4 modulo 4 pi", *theta1),
        Row("special cases", special, "Hess: alpha0 = beta0; Grioli: gamma0 = beta0"),
    ]
