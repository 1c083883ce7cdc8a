"""Closed forms: no integration at all."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.tasks import (
    Carrier,
    MotionTask,
    aligned_states,
    carrier,
    direction,
    moments,
)
from rigidpend.mechanics.coordinates import Aligned
from rigidpend.mechanics.equations import cross
from rigidpend.mechanics.hodograph import angular_velocity
from rigidpend.mechanics.pendulum import body_motion
from rigidpend.mechanics.poinsot.herpolhode import angle
from rigidpend.mechanics.poinsot.orbit import Orbit, through
from rigidpend.mechanics.poinsot.polhode import momentum
from rigidpend.numbers.doubles import Array


def pendulum(task: MotionTask, _: float, threads: int) -> Carrier:
    """The pendulum motions (5:3), one after the other, in Python's floats."""
    A3, r, mu = moments(task.body)[2], direction(task.body), float(task.body.mu)
    assert task.h0 is not None
    energies = [float(h0) for h0 in task.h0]

    def at(time: float) -> Array:
        ends = [body_motion(time, -1, A3, r, h0, mu, math) for h0 in energies]
        return np.array([(*M, *gamma) for M, gamma in ends]).T

    return carrier(task.states, lambda _, __, time: at(time))


def free_body(task: MotionTask, _: float, threads: int) -> Carrier:
    """The free body by Jacobi's functions, one orbit after the other."""
    orbits = [_orbit(task, state) for state in task.states.T]

    def at(time: float) -> Array:
        return np.stack([_ended(*orbit, time) for orbit in orbits], axis=1)

    return carrier(task.states, lambda _, __, time: at(time))


def _orbit(task: MotionTask, state: Array) -> tuple[Orbit, float, float]:
    """The orbit through a state, the time on it, and the angle of gamma in space."""
    M, gamma = state[:3], state[3:]
    [aligned] = aligned_states(task.body, state[:, None]).T
    orbit, begin = through(task.body, Aligned(*aligned))
    radius, across = _axes(M, orbit)
    lean = math.atan2(gamma @ across, gamma @ radius)
    return orbit, begin, lean + float(angle(orbit, begin))


def _ended(orbit: Orbit, begin: float, lean: float, time: float) -> Array:
    """M and gamma, which stands still in space, across M."""
    M = momentum(orbit, begin + time)
    radius, across = _axes(M, orbit)
    left = lean - float(angle(orbit, begin + time))
    return np.concatenate((M, math.cos(left) * radius + math.sin(left) * across))


def _axes(M: Any, orbit: Orbit) -> tuple[Array, Array]:
    """Unit vectors across M, in body axes: along the component of omega, and a right angle on."""
    across = np.array(cross(M, angular_velocity(M, orbit.shape.A)))
    across /= np.linalg.norm(across)
    return np.array(cross(across, M)) / orbit.G, across
