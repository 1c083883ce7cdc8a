"""theta2_0 of doubly asymptotic orbits to 30 digits, by integration in 106 bits, many at once.

An orbit is integrated from its start until it is close to the periodic orbit at its end. There
the normal form tells the invariant I of the passage, which is 0 if the orbit is asymptotic, and
the map tells by how much I changes with theta2. The closer to the end, the smaller an I is told:
what doubles make of it errs by 1e-16 of the square of the distance.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple, TypeAlias

import numpy as np

from rigidpend.numbers.doubles import Array
from rigidpend.orbits.integrate.states import states_after
from rigidpend.orbits.return_map.conjugacy import inverted
from rigidpend.orbits.return_map.poincare import rotation_phase
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.doubly import DoublyAsymptotic
from rigidpend.routes.symbolic.launch import Anchors, Launch

FIRST_ERROR = 1e-12
"""Error of b by the map in doubles, radians, at most."""
GAINED = 1e-6
"""Share of an error that a correction leaves, at most."""
NEAREST, FARTHEST = 1e-9, 1e-2
"""Distances from the periodic orbit at which orbits end, as v of the normal form."""
ROUNDS = 8
FINEST = 3e-30
"""Size of the last correction at which 106 bits are used up, radians: a third of the 30th digit."""
DIGITS = 29
"""Digits of theta2_0 behind the point; its size is 6 at most."""


States: TypeAlias = list[list[Fraction]]


class Sharp(NamedTuple):
    """Phases to 30 digits, (N,) each."""

    theta2_0: list[Fraction]
    """Radians in [0, 2 pi), where J1 is J1_0."""
    starts: States
    """Aligned components at the starts of `launch`, to 106 bits."""
    moved: Array
    """Corrections of the map by integration, radians."""
    error: Array
    """Size of the last correction, radians."""


def sharp(launch: Launch, orbits: DoublyAsymptotic, jobs: int = 1) -> Sharp:
    """Refine the phases of doubly asymptotic orbits.

    Parameters
    ----------
    launch : Launch
    orbits : DoublyAsymptotic
        By the map in doubles.
    jobs : int, optional

    Raises
    ------
    NoOrbit
        Integration finds an orbit elsewhere than the map.
    """
    begun, error = launch.anchors(orbits.b), FIRST_ERROR
    slope = orbits.I_slope * begun.b_slope
    here = _exactly(launch, begun, [Fraction(float(x)) for x in begun.theta2])
    known = [here]
    for _ in range(ROUNDS):
        distance = np.sqrt(np.abs(orbits.I_slope) * error).clip(NEAREST, FARTHEST)
        step = -_invariant(launch, orbits, here.states, distance, jobs) / slope
        last = float(np.abs(step).max(initial=0.0))
        if last > 10 * error:
            raise NoOrbit(f"integration finds an orbit {last:.2g} rad from where the map has it")
        theta2 = [x + Fraction(float(y)) for x, y in zip(here.theta2, step, strict=True)]
        # Steps are so small behind the first that states are straight in them to 1e-38.
        here = _ahead(known[0], known[1], theta2) if known[1:] else _exactly(launch, begun, theta2)
        known = [*known, here][:2]
        if last < FINEST:
            break
        error = max(last * GAINED, FINEST)
    else:
        raise NoOrbit(f"theta2_0 does not settle below {last:.2g} rad")
    moved = [float(x - Fraction(float(y))) for x, y in zip(here.theta2, begun.theta2, strict=True)]
    theta2_0 = launch.at_J1_0(begun, here.states, jobs)
    return Sharp(theta2_0, here.states, np.array(moved), np.abs(step))


class _Starts(NamedTuple):
    """Phases and states where orbits begin."""

    theta2: list[Fraction]
    states: States


def _exactly(launch: Launch, begun: Anchors, theta2: list[Fraction]) -> _Starts:
    return _Starts(theta2, launch.states(begun, theta2))


def _ahead(first: _Starts, second: _Starts, theta2: list[Fraction]) -> _Starts:
    """The starts at theta2, on the straight lines through two that are known."""
    found = []
    for x, X, y, Y, z in zip(*first, *second, theta2, strict=True):
        share = (z - y) / (y - x) if y != x else Fraction(0)
        found.append([_rounded(b + share * (b - a)) for a, b in zip(X, Y, strict=True)])
    return _Starts(theta2, found)


def _rounded(x: Fraction) -> Fraction:
    """The sum of two doubles next to a number."""
    high = Fraction(float(x))
    return high + Fraction(float(x - high))


def _invariant(
    launch: Launch,
    orbits: DoublyAsymptotic,
    states: States,
    distance: Array,
    jobs: int,
) -> Array:
    """I of the last passages, measured where the orbits are so close to the periodic orbit."""
    level, upper = launch.level, len(orbits.symbols) % 2 == 0
    start = launch.clock(launch.theta2(orbits.b, float(launch.J1)), float(launch.J1))
    times = orbits.begun(level) - start + orbits.flight + orbits.faded(level, distance)
    found = states_after(launch.fractions, states, list(times), jobs)
    at = np.array(found, dtype=float).T
    if not upper:
        at[[2, 5]] *= -1
    made = level.map_level
    psi = rotation_phase(at, launch.doubles, made.a)
    if not (np.hypot(at[0], at[1]) < math.sqrt(FARTHEST)).all():
        raise NoOrbit("an orbit leaves the periodic orbit before its end")
    beside = inverted(made.nf, made.weights, psi, at[0], at[1], made.a)
    return np.asarray(beside.u * beside.v)
