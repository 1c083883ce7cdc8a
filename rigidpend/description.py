"""Descriptions: rows of name, value and meaning, as `describe` and `theory` print them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rigidpend.body import Body


class Row(NamedTuple):
    """A line of a description."""

    name: str
    value: str
    meaning: str
    number: float | Sequence[float] | None = None
    """The value as a number, or a list of numbers, where it is that."""


def number_row(name: str, meaning: str, *numbers: float) -> Row:
    """A row of one or several numbers, which programs get as such."""
    values = [float(x) for x in numbers]
    return Row(name, ", ".join(map(repr, values)), meaning, values if values[1:] else values[0])


def body_rows(body: Body) -> list[Row]:
    """A body's parameters and what follows from them."""
    special = ", ".join(body.special_cases) or "none"
    return [
        Row("A", ", ".join(map(str, body.A)), "principal moments of inertia A1, A2, A3"),
        Row("r", ", ".join(map(str, body.r)), "direction to the centre of gravity"),
        Row("mu", str(body.mu), "weight times distance of the centre of gravity"),
        number_row("alpha0", "rad", body.alpha0),
        number_row("beta0", "rad", body.beta0),
        number_row("gamma0", "rad", body.gamma0),
        number_row("kappa", "A1 A2/(A3 (A1 - A2))", body.kappa),
        number_row("nu", "pi kappa/sin(alpha0)", body.nu),
        Row("special cases", special, "Hess: alpha0 = beta0; Grioli: gamma0 = beta0"),
    ]
