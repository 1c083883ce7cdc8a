"""Errors of orbits that are integrated in doubles, predicted and measured.

Every step of an integrator rounds every component once. The variational equations propagate these
roundings along the orbit; they are independent, so their squares add. Nothing is fitted.
"""

import math
from typing import Any

import numpy as np

from rigidpend.experiments.stress.scenes import TRUTH_BITS, Scene, followed, phase_errors
from rigidpend.mechanics.equations import aligned, variational
from rigidpend.numbers import Array
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.integrate.states import states_at

ROUNDING = math.sqrt(3 / (8 * math.log(2)) / 12)
"""Root mean square of a rounding, relative to its number, in units of 2^(1 - bits).

It is 1/sqrt(12) of the mantissa's last bit; the mantissa m has the density 1/(m ln 2) on 1 to 2."""
NOISE = ROUNDING * 2.0**-52
"""Root mean square relative error of a step in doubles; the truncation error is smaller."""
SHARE = math.exp(-2)
"""Step of a Taylor series over its radius of convergence."""
SAMPLES = 0.2
"""Time between samples of a tangent vector, in units of 1/u."""
DEVIATIONS = 10
"""Bound for the error of a single orbit, in units of its predicted root mean square."""
TOLERANCE = 1e-11
"""Tolerance of the variational equations: a prediction needs three digits."""


def step(u: float) -> float:
    """The step of a Taylor integrator in t', near separatrices of exponent u.

    On them J1 = J2/(exp(-u t' + v) + 1) has its poles pi/u off the real axis.
    """
    return SHARE * math.pi / u


def compared(
    scene: Scene, states: Array, n_crossings: int, limit: float
) -> tuple[Array, Array, Array]:
    """Phase errors of doubles against 113 bits, predicted errors, and the last bit of the times.

    All are in radians, (n_crossings, n); each passage may take t' = `limit`.
    """
    orbits = Orbits(scene.c, states, n_crossings, limit)
    # The truth starts from the same doubles, so that rounding of the start is not counted.
    found, true = followed(scene, orbits), followed(scene, orbits, TRUTH_BITS)
    predicted = predicted_errors(scene, states, true.time)
    floor = scene.rate * np.spacing(true.time)
    return phase_errors(found, true, scene.rate), predicted, floor


def predicted_errors(scene: Scene, states: Array, crossings: Array) -> Array:
    """Predicted root mean square errors of crossings in doubles, in radians, (k, n).

    `states` are (6, n), at time 0; `crossings` their times t', (k, n).
    """
    times, orbits, errors = deviations(scene, states, crossings.max())
    # As in a Newton step: a deviation of M3 shifts the crossing in time by itself over M3'.
    shifts = scene.rate * np.abs(errors[:, 2] / aligned(orbits.swapaxes(0, 1), scene.c)[2])
    each = zip(crossings.T, shifts.T, strict=True)
    return np.array([np.interp(own, times, shift) for own, shift in each]).T


def deviations(scene: Scene, states: Array, end: float) -> tuple[Array, Array, Array]:
    """Times of an integrator's steps to t' = `end`, orbits there, (k, 6, n), and their errors.

    The errors are root mean squares of the components, from one rounding of each in every step.
    """
    field = variational(scene.c)
    times = np.linspace(0.0, end, 2 + int(abs(end) / step(scene.u)))
    found, vectors = [(states, np.zeros(states.shape))], np.zeros((6, *states.shape))
    for _ in times[1:]:
        states, vectors = carried(field, states, vectors, times[1:2])
        found.append((states, np.linalg.norm(vectors, axis=1)))
    orbits, errors = np.array(found).swapaxes(0, 1)
    return times, orbits, errors


def carried(field: Any, states: Array, vectors: Array, time: Array) -> tuple[Array, Array]:
    """Orbits after a step, and a square root of the covariance of their errors: six vectors.

    Axes of `vectors` are component, vector, orbit. The covariance itself would lose its small parts
    to rounding.
    """
    # One integration carries each orbit with each of its six vectors: 12 rows, 6 n columns.
    here = np.broadcast_to(states[:, None], vectors.shape)
    start = np.concatenate((here, vectors)).reshape(12, -1)
    y = states_at(field, start, time)[:, 0].reshape(12, *vectors.shape[1:])
    states = y[:6, 0]
    # The six vectors as they were carried, and a rounding of each component.
    twelve = np.concatenate((y[6:], NOISE * states * np.eye(6)[:, :, None]), axis=1)
    # With the vectors of an orbit as rows of V, R^T R = V^T V: six vectors of the same covariance.
    triangle: Any = np.linalg.qr(twelve.transpose(2, 1, 0), mode="r")
    return states, triangle.transpose(2, 1, 0)


def growths(scene: Scene, state: Array, until: float) -> tuple[Array, Array]:
    """Crossing times of an orbit, and the logarithm of the growth of a small phase error there.

    The orbit is followed to t' = `until`; both are (k,) arrays, and the logarithm at the first
    crossing is 0.
    """
    times = np.arange(0.0, until, SAMPLES / scene.u)
    # A shift of the phase: M is nearly along Oz at the start, and gamma turns about that axis.
    start = np.r_[state, 0.0, 0.0, 0.0, -state[4], state[3], 0.0]
    y = states_at(variational(scene.c), start, times, tolerance=TOLERANCE)
    M3 = y[2]
    k = np.flatnonzero(M3[:-1] * M3[1:] < 0)
    # Between samples M3 and its deviation are taken as linear, which is enough for a prediction.
    share = M3[k] / (M3[k] - M3[k + 1])
    shift = (y[8, k] + share * (y[8, k + 1] - y[8, k])) / aligned(y[:6, k], scene.c)[2]
    logarithm = np.log(np.abs(shift))
    return times[k] + share * (times[k + 1] - times[k]), logarithm - logarithm[:1]
