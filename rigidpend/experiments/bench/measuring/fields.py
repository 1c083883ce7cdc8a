"""The fields that the methods integrate, all composed of the package's equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rigidpend.experiments.bench.measuring.tasks import direction, moments
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import euler_poisson
from rigidpend.mechanics.hodograph import angular_velocity, hodograph
from rigidpend.mechanics.precession import turning_rate
from rigidpend.numbers.generic import Numbers, Scalar

Field = Callable[[Any], tuple[Any, ...]]

SMALLER = 1e-2
"""The absolute tolerance, of the relative one: for components that pass through zero."""


def principal(A: Numbers, r: Numbers, mu: Scalar) -> Field:
    """Euler-Poisson in principal axes, of 6 numbers."""
    return lambda y: euler_poisson(y[:3], y[3:6], A, r, mu)


def with_angles(A: Numbers, r: Numbers, mu: Scalar) -> Field:
    """The same with the rates of theta3 and alpha, of 8 numbers."""

    def field(y: Scalar) -> tuple[Any, ...]:
        M, gamma = y[:3], y[3:6]
        rates = euler_poisson(M, gamma, A, r, mu)
        omega, domega = angular_velocity(M, A), angular_velocity(rates[:3], A)
        return (*rates, turning_rate(M, r, mu), hodograph(omega, gamma, domega)[2])

    return field


def of_body(body: Body, angles: bool = False) -> Field:
    """The field of a body in floats."""
    make = with_angles if angles else principal
    return make(moments(body), direction(body), float(body.mu))
