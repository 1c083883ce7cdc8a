"""Descriptions: rows of name, value and meaning, as `describe` and `theory` print them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import Exact


class Row(NamedTuple):
    """A line of a description."""

    name: str
    value: str
    meaning: str
    number: float | Sequence[float] | None = None
    """The value as a number, or a list of numbers, where it is that."""


def number_row(name: str, meaning: str, *numbers: float) -> Row:
    """A row of one or several numbers, which programs get as such."""
    # A zero has no sign for a reader.
    # A single number stands for itself, so that programs need not unpack a list of one.
    values = [float(x) + 0.0 for x in numbers]
    return Row(name, ", ".join(map(repr, values)), meaning, values if values[1:] else values[0])


def exact_row(name: str, meaning: str, *numbers: Exact | int) -> Row:
    """A row of one or several numbers as they were written, rounded for programs."""
    values = [x if isinstance(x, int) else float(x) + 0.0 for x in numbers]
    written = ", ".join(map(str, numbers))
    return Row(name, written, meaning, values if values[1:] else values[0])


def body_rows(body: Body) -> list[Row]:
    """A body's parameters and what follows from them."""
    special = ", ".join(body.special_cases) or "none"
    return [
        exact_row("A", "principal moments of inertia A1, A2, A3", *body.A),
        exact_row("r", "direction to the centre of gravity", *body.r),
        exact_row("mu", "weight times distance of the centre of gravity", body.mu),
        number_row("alpha0", "rad", body.alpha0),
        number_row("beta0", "rad", body.beta0),
        number_row("gamma0", "rad", body.gamma0),
        number_row("kappa", "A1 A2/(A3 (A1 - A2))", body.kappa),
        number_row("nu", "pi kappa/sin(alpha0)", body.nu),
        Row("special cases", special, "Hess: alpha0 = beta0; Grioli: gamma0 = beta0"),
    ]
