"""The fields that the methods integrate, all composed of the package's equations.

For peers they are written out flat, in plain Python that a compiler takes too, as a hand would for
speed: from the tape that the package's own compiled fields are made of.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from rigidpend.experiments.principal_axes import euler_poisson_field
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import scale
from rigidpend.mechanics.equations import euler_poisson
from rigidpend.mechanics.hodograph import angular_velocity, hodograph
from rigidpend.mechanics.precession import turning_rate
from rigidpend.numbers.generic import Numbers, Scalar
from rigidpend.orbits.integrate.kernel.tape import trace

Field = Callable[[Any], tuple[Any, ...]]

SMALLER = 1e-2
"""The absolute tolerance, of the relative one: for components that pass through zero."""


def time_unit(body: Body) -> float:
    """s, by which t' = t s."""
    return float(scale(body.floats()[0], math))


def with_angles(A: Numbers, r: Numbers, mu: Scalar) -> Field:
    """Euler-Poisson with the rates of theta3 and alpha, of 8 numbers."""

    def field(y: Scalar) -> tuple[Any, ...]:
        M, gamma = y[:3], y[3:6]
        rates = euler_poisson(M, gamma, A, r, mu)
        omega, domega = angular_velocity(M, A), angular_velocity(rates[:3], A)
        return (*rates, turning_rate(M, r, mu), hodograph(omega, gamma, domega)[2])

    return field


def of_body(body: Body, angles: bool = False) -> Field:
    """The field of a body in floats."""
    make = with_angles if angles else euler_poisson_field
    return make(*body.floats())


SIGNS = {"plus": "+", "minus": "-", "times": "*", "divided": "/"}


def flat(body: Body, angles: bool = False) -> Any:
    """Write ``rates(dy, t, y, args)``, which takes floats or arrays, and which numba can compile.

    It has 6 components, or 8 with angles; each quantity is a local variable.
    """
    make, size = (with_angles, 8) if angles else (euler_poisson_field, 6)
    A, r, mu = body.floats()
    # The moments are components too, for the tape multiplies by reciprocals of parameters: with
    # quotients, which round once, CyRK was a sixth faster.
    traced, parameters = trace(lambda y, _: make(y[size:], r, mu)(y[:size]), size + 3)
    components = [*(f"y{i}" for i in range(size)), *map(repr, A)]
    names: list[str] = []
    known: dict[str, str] = {}
    for name, operands in traced.lines:
        if name == "component":
            names.append(components[operands[0]])
        elif name == "parameter":
            names.append(repr(parameters[operands[0]]))
        else:
            left, right = (names[i] for i in operands)
            text = f"{left} {SIGNS[name]} {right}"
            # The tape tells parameters apart, even equal ones.
            whole = name == "divided" and right == "1.0"
            names.append(left if whole else known.setdefault(text, f"x{len(known)}"))
    lines = [
        *(f"y{i} = y[{i}]" for i in range(size)),
        *(f"{name} = {expression}" for expression, name in known.items()),
        *(f"dy[{i}] = {names[k]}" for i, k in enumerate(traced.rates)),
    ]
    room: dict[str, Any] = {}
    exec(compile("\n    ".join(["def rates(dy, t, y, args):", *lines]), "<field>", "exec"), room)
    return room["rates"]
