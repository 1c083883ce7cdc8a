"""Tasks and answers of a method: plain data, physical units.

States are (6, n): M and gamma in principal axes. Times are physical.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import scale
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.routes.cycle import symbols
from rigidpend.routes.problem import RouteProblem


class MotionTask(NamedTuple):
    """Orbits to be carried from time 0 to `end`."""

    body: Body
    states: Array
    """(6, n) at time 0, with M . gamma = 0."""
    end: float
    period: float
    """A typical period, which a method with fixed steps divides."""
    h0: Array | None = None
    """Energies of pendulum motions, exact, from which closed forms start."""


class RouteTask(NamedTuple):
    """Orbits of which the symbols are sought."""

    problem: RouteProblem
    theta2_0: Any
    """Initial phases in radians: texts, exact, or an array of doubles."""
    states: Array
    """(6, n) at time 0."""
    horizon: float
    """A time by which every orbit has made all its crossings: a help that ours does without."""
    period: float


class AngleTask(NamedTuple):
    """Orbits of which alpha, the angle of omega's horizontal part, is sought."""

    problem: RouteProblem
    theta2_0: tuple[str, ...]
    states: Array
    """(8, n) at time 0: M, gamma, theta3, alpha."""
    ends: Array
    """(n,): when."""
    period: float


class Carrier(NamedTuple):
    """A method's answer to a :class:`MotionTask`: orbits that it carries on."""

    start: Callable[[], Any]
    """Go back to time 0."""
    to: Callable[[float], Any]
    """Advance all orbits to a later time."""
    states: Callable[[], Array]
    """States of the orbits now, (6, n)."""


class Solver(NamedTuple):
    """A method's answer to :class:`RouteTask` or :class:`AngleTask`."""

    solve: Callable[[], Any]
    """All the work that is timed."""
    read: Callable[[Any], Any]
    """From what `solve` gave to the answer: :class:`Crossed`, or alpha (n,)."""


class Crossed(NamedTuple):
    """The answer to :class:`RouteTask`."""

    codes: NDArray[np.uint8]
    """(n_symbols, n)."""
    time: Array
    """(n_symbols + 1, n), t'."""
    certain: Any = None
    """(n_symbols, n), of a method that says which symbols it vouches for."""


def carrier(
    first: Any,
    advance: Callable[[Any, float, float], Any],
    read: Callable[[Any], Array] = np.asarray,
) -> Carrier:
    """A carrier that keeps the time and the states of all orbits.

    Parameters
    ----------
    first : array
        States at time 0.
    advance : callable
        From states, their time and a later one to the states then.
    read : callable, optional
        From states, in whatever form they are kept, to those of the answer.
    """
    now: list[Any] = [0.0, first]

    def begin() -> None:
        now[:] = [0.0, first]

    def to(time: float) -> None:
        now[:] = [time, advance(now[1], now[0], time)]

    return Carrier(begin, to, lambda: read(now[1]))


def orbits_of(task: Any, columns: Any) -> Any:
    """The same task for some of its orbits.

    Parameters
    ----------
    task : MotionTask, RouteTask or AngleTask
    columns : array of int
    """
    changes: dict[str, Any] = {"states": np.ascontiguousarray(task.states[:, columns])}
    if isinstance(task, MotionTask):
        changes["h0"] = None if task.h0 is None else task.h0[columns]
    else:
        phases = task.theta2_0
        plain = isinstance(phases, np.ndarray)
        changes["theta2_0"] = phases[columns] if plain else tuple(phases[k] for k in columns)
    if isinstance(task, AngleTask):
        changes["ends"] = task.ends[columns]
    return task._replace(**changes)


def crossed(time: Any, M: Any, body: Body) -> Crossed:
    """The answer from what was found at crossings of M3 = 0.

    Parameters
    ----------
    time : (n_symbols + 1, n) array
        Physical; NaN where there is no crossing.
    M : (2 or more, n_symbols + 1, n) array
        M1 and M2 there, or near enough to have the signs of Qp and Qm.
    body : Body
    """
    # M3 goes upwards and downwards in turn.
    rising = np.arange(len(time))[:, None] % 2 == 0
    half = body.alpha0 / 2
    along, across = math.cos(half) * M[0], math.sin(half) * M[1]
    beside = np.where(rising, np.where(along + across > 0, 2, 4), np.where(along < across, 1, 3))
    return Crossed(
        symbols(np.where(np.isnan(time), 0, beside)).astype(np.uint8), time_unit(body) * time
    )


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
