"""Table of a body by the paper's theory and the exact periodic orbits."""

import math
from collections.abc import Iterator
from typing import Any

from rigidpend.config.description import Row, derived_rows, number_row
from rigidpend.mechanics import floquet, in_space
from rigidpend.mechanics.body import Angles, Body
from rigidpend.mechanics.free_body import SEPARATRICES
from rigidpend.mechanics.pendulum import Delta_1
from rigidpend.numbers import Scalar
from rigidpend.numbers.exact import Exact, context, exact
from rigidpend.routes.problem import RouteProblem
from rigidpend.surfaces import melnikov

BITS = 113
"""Precision of what follows from the first order in closed form, before it is rounded."""


def rows(body: Body, h0: Scalar, J1_0: Scalar = None) -> list[Row]:
    """Make the table of a body at an energy constant h0 = kappa J2_0^2/2, greater than mu.

    Only Melnikov's zeros depend on the initial action J1_0, dimensionless.
    """
    # Only Melnikov's zeros depend on J1_0: without one they are left out, and any value will do.
    problem = RouteProblem(body, h0, exact("1e-8") if J1_0 is None else J1_0, 1)
    energy = problem.h0
    p, J2_0 = body.angles(BITS), float(problem.J2_0(53))
    regime = in_space.regime(body)
    return [
        number_row("A", "principal moments of inertia A1, A2, A3", *body.A),
        # Of length one, which takes roots: in doubles, as all that follows from a root.
        number_row("r", "direction to the centre of gravity, of length 1", *map(float, body.r)),
        number_row("mu", "weight times distance of the centre of gravity", body.mu),
        *derived_rows(body),
        number_row("h0", "energy constant, kappa J2_0^2/2", energy),
        number_row("J2_0", "initial |M|, dimensionless", J2_0),
        *_first_order(problem),
        *(_zeros(problem) if J1_0 is not None else ()),
        Row("regime", regime.name, f"of (trieq): separatrices by increment, {regime}"),
        number_row(
            "Delta theta3",
            "rad, increments along separatrices 1 to 4, to O(mu)",
            *in_space.increments(p, float(energy)),
        ),
        *_orbits(p, float(energy)),
    ]


def of(problem: Any) -> list[Row]:
    """Make the table of a config's body; empty unless the config has one body and one h0."""
    body, h0 = getattr(problem, "body", None), getattr(problem, "h0", None)
    # An experiment may ask for several energies at once.
    if body is None or not isinstance(h0, Exact):
        return []
    return rows(body, h0, getattr(problem, "J1_0", None))


def _first_order(problem: RouteProblem) -> Iterator[Row]:
    # A large nu's rounding grows in amplitudes, which may be far below all doubles, but not zero.
    m, p, J2_0 = context(BITS), problem.body.angles(BITS), problem.J2_0(BITS)
    h0 = problem.h0.at(BITS)
    for epsilon, beside in ((1, "2 and 4"), (-1, "1 and 3")):
        meaning = f"rad, largest swing of theta1 beside separatrices {beside}, to O(mu)"
        yield number_row(f"Delta_1({epsilon:+d})", meaning, Delta_1(p, h0, epsilon, m))
    amplitudes = [melnikov.amplitude(n, J2_0, p, m) for n in SEPARATRICES]
    written = ", ".join(repr(float(x)) if float(x) or not x else m.nstr(x, 3) for x in amplitudes)
    meaning = "of cos(delta + theta2_0), separatrices 1 to 4"
    row = number_row("Melnikov amplitude", meaning, *map(float, amplitudes))
    yield row._replace(value=written)


def _zeros(problem: RouteProblem) -> Iterator[Row]:
    yield number_row("J1_0", "initial action, dimensionless", problem.J1_0)
    missed = melnikov.missed(problem)
    changes = f"where the first symbol changes, to O(mu) and {missed:.1g}"
    if missed >= 1:
        changes = "which say little of the first symbol: J1_0 is not small enough"
    meaning = f"rad, theta2_0 on separatrix 2, {changes}"
    yield number_row("Melnikov zeros", meaning, *melnikov.zeros(problem))


def _orbits(p: Angles, h0: float) -> Iterator[Row]:
    """Rows of the exact periodic orbits; both families have the same multipliers, by symmetry."""
    meaning = "Floquet multipliers of the periodic orbits, transverse; product 1"
    try:
        leaving, approaching = (floquet.periodic_orbit(p, h0, 1, epsilon) for epsilon in (1, -1))
    except floquet.NotHyperbolic as error:
        yield Row("multipliers", "on the unit circle", str(error))
        return
    except (ArithmeticError, ValueError) as error:
        # Here h0 - mu is within the rounding of h0 and mu.
        yield Row("multipliers", "not resolved", str(error))
        return
    yield number_row("period", "t', of the pendulum motions", leaving.period)
    yield number_row("multipliers", meaning, leaving.multiplier, approaching.multiplier)
    # Without weight T is 2 pi/(kappa J2_0), so that u T/2 is pi^2/nu whatever the energy.
    meaning = "exp(u T/2), u = J2_0 sin(alpha0), T = 2 pi/(kappa J2_0)"
    yield number_row("multiplier, mu = 0", meaning, math.exp(math.pi**2 / float(p.nu)))
