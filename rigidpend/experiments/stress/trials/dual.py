"""Derivatives of fields by dual numbers: the equations themselves, run over value and slope."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rigidpend.numbers.generic import Scalar

Function = Callable[[Sequence[Any]], Sequence[Any]]


@dataclass(frozen=True, slots=True)
class Dual:
    """A number, an array or a symbol, with its derivative in some direction."""

    value: Any
    slope: Any

    # The fields are polynomials, so sums and products are all that is asked for.
    def __add__(self, other: Scalar) -> Dual:
        b = _dual(other)
        return Dual(self.value + b.value, self.slope + b.slope)

    def __mul__(self, other: Scalar) -> Dual:
        b = _dual(other)
        return Dual(self.value * b.value, self.value * b.slope + self.slope * b.value)

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Scalar) -> Dual:
        return self + -_dual(other)

    def __rsub__(self, other: Scalar) -> Dual:
        return -self + other

    __radd__, __rmul__ = __add__, __mul__


def _dual(x: Scalar) -> Dual:
    return x if isinstance(x, Dual) else Dual(x, 0.0)


def tangent(f: Function, x: Sequence[Any], v: Sequence[Any]) -> list[Any]:
    """The derivative of f at x in the direction v."""
    return [y.slope for y in f([Dual(a, b) for a, b in zip(x, v, strict=True)])]


def cotangent(f: Function, x: Sequence[Any], weights: Sequence[Any]) -> list[Any]:
    """The gradient of ``sum(weights * f)`` at x."""
    units = ([float(i == j) for j in range(len(x))] for i in range(len(x)))
    slopes = (tangent(f, x, unit) for unit in units)
    return [sum(w * s for w, s in zip(weights, column, strict=True)) for column in slopes]
