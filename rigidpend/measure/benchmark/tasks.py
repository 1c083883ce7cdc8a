"""What a method is asked for and what it answers with: plain data, physical units.

States are (6, n): M and gamma in principal axes. Times are physical.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.body import Body
from rigidpend.coordinates import momentum, scale, vertical
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.routes.problem import RouteProblem

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """Orbits to be carried from time 0 to `end`."""

    body: Body
    states: Array
    """(6, n) at time 0, with M . gamma = 0."""
    end: float
    period: float
    """A typical period, which a method with fixed steps divides."""
    h0: Array | None = None
    """Of pendulum motions, exact: their energies, from which closed forms start."""


class Routes(NamedTuple):
    """Orbits of which the symbols are sought."""

    problem: RouteProblem
    theta2_0: Any
    """Initial phases in radians: texts, exact, or an array of doubles."""
    states: Array
    """(6, n) at time 0."""
    horizon: float
    """A time by which every orbit has made all its crossings: a help that ours does without."""
    period: float


class Angle(NamedTuple):
    """Orbits of which alpha, the angle of omega's horizontal part, is sought."""

    problem: RouteProblem
    theta2_0: tuple[str, ...]
    states: Array
    """(8, n) at time 0: M, gamma, theta3, alpha."""
    ends: Array
    """(n,): when."""
    period: float


class Flow(NamedTuple):
    """A method's answer to a :class:`Motion`: orbits that it carries on."""

    start: Callable[[], Any]
    """Go back to time 0."""
    to: Callable[[float], Any]
    """Advance all orbits to a later time."""
    states: Callable[[], Array]
    """Where they are now, (6, n)."""


class Solver(NamedTuple):
    """A method's answer to :class:`Routes` or :class:`Angle`."""

    solve: Callable[[], Any]
    """All the work that is timed."""
    read: Callable[[Any], Any]
    """From what `solve` gave to the answer: :class:`Crossed`, or alpha (n,)."""


class Crossed(NamedTuple):
    """The answer to :class:`Routes`."""

    codes: NDArray[np.uint8]
    """(n_symbols, n)."""
    time: Array
    """(n_symbols + 1, n), t'."""


def moments(body: Body) -> list[float]:
    """A of the body, floats."""
    return [float(x) for x in body.A]


def direction(body: Body) -> list[float]:
    """r of the body, floats."""
    return [float(x) for x in body.r]


def time_unit(body: Body) -> float:
    """s, by which t' = t s."""
    return float(scale(moments(body), math))


def aligned_states(body: Body, states: Array) -> Array:
    """Aligned components (6, n) of states (6, n), doubles that are taken exactly, rounded once.

    `coordinates.aligned_from_body` in more bits: beside a separatrix the small component is a
    difference, and what is lost there the whole orbit shows.
    """
    m = context(53 + GUARD_BITS)
    half = body.angles(53 + GUARD_BITS).alpha0 / 2
    s = scale([x.in_context(m) for x in body.A], m)
    found = states.copy()
    found[2] *= float(s)
    for k, (M1, M2) in enumerate(states[:2].T):
        x, y = s * m.cos(half) * m.mpf(M1), s * m.sin(half) * m.mpf(M2)
        found[:2, k] = float(x + y), float(x - y)
    return found


def initial(problem: RouteProblem, theta2_0: Any, bits: int = 53) -> list[list[Any]]:
    """M and gamma at the start of each orbit, n lists of 6 numbers in `bits` bits.

    The start is theta1_0 = alpha0 + beta0, J1_0, J2_0, J3 = 0 in Andoyer variables, rounded
    once.
    """
    m = context(bits + GUARD_BITS)
    p = problem.body.angles(bits + GUARD_BITS)
    J1, J2 = problem.J1_0.in_context(m), m.mpf(problem.J2_0(bits + GUARD_BITS))
    p_pair = ((2 * J1 - J2) / J2, 2 * m.sqrt(J1 * (J2 - J1)) / J2)
    sinl, cosl = m.sin(p.alpha0 / 2), m.cos(p.alpha0 / 2)
    G = J2 / scale([x.in_context(m) for x in problem.body.A], m)
    found = []
    for theta2 in theta2_0:
        g = (p.alpha0 + p.beta0) / 2 + theta2.in_context(m)
        gamma = vertical(p_pair, (m.mpf(0), m.mpf(1)), (m.sin(g), m.cos(g)), (sinl, cosl))
        M = momentum(G, *p_pair, sinl, cosl)
        found.append([context(bits).mpf(x) for x in (*M, *gamma)])
    return found
