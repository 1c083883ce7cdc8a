"""The rounding error of a crossing, predicted from the variational equations.

Every step of an integrator rounds every component once. What a rounding at time s does to the
phase at a crossing is the cotangent vector there, carried back along the orbit; the roundings
are independent, so their squares add. Nothing is fitted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from rigidpend.experiments.stress.scenes import BITS, Scene, followed, phase_errors
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.generic import Array, Numbers, Scalar
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.integrate.states import states_at

ROUNDING = math.sqrt(3 / (8 * math.log(2)) / 12)
"""Root mean square of a rounding, relative to its number, in units of 2^(1 - bits).

It is 1/sqrt(12) of the mantissa's last bit, the mantissa being distributed as 1/m over 1 to 2."""
NOISE = ROUNDING * 2.0**-52
"""Root mean square relative error of a step in doubles: the series' own error is below rounding."""
SHARE = math.exp(-2)
"""Step of a Taylor series over its radius of convergence."""
SAMPLES = 0.2
"""Time between samples of cotangent vectors, in units of 1/u."""
DEEPEST = 30.0
"""Longest time, in units of 1/u, that an orbit is followed backwards in one go."""
DEVIATIONS = 10
"""Bound over predicted root mean square, where one orbit's error is measured."""
TOLERANCE = 1e-11
"""Tolerance of the variational equations: a prediction needs three digits."""


def step(u: float) -> float:
    """The step of a Taylor integrator in t', near separatrices of exponent u.

    On them J1 = J2/(exp(-u t' + v) + 1) has its poles pi/u off the real axis.
    """
    return SHARE * math.pi / u


def predicted_errors(scene: Scene, states: Array, crossings: Array) -> Array:
    """The root mean square errors of crossings in doubles, in radians, (k, n).

    `states` are (6, n), at time 0; `crossings` their times t', (k, n), ascending.
    """
    each = zip(states.T, crossings.T, strict=True)
    return np.array([_predicted(scene, state, times) for state, times in each]).T


def _predicted(scene: Scene, state: Array, crossings: Array) -> Array:
    begun = restarts(np.r_[0.0, crossings], scene.u)
    times, c = np.union1d(begun, crossings), scene.c
    states = states_at(c, state, times)
    errors = []
    for t in crossings:
        inside = (times == t) | (np.isin(times, begun) & (times < t))
        squares = _squares(scene, times[inside], states[:, inside])
        # One rounding a step: the sum over steps is the integral over the length of a step.
        errors.append(NOISE * math.sqrt(squares / step(scene.u)))
    return np.array(errors)


def restarts(times: Array, u: float) -> Array:
    """Times at which a cotangent vector goes on from the orbit as it was followed forwards.

    Backwards, the orbit leaves itself as exp(u t'/2). So a passage that is too long for doubles
    is divided.
    """
    parts = [times[:1]]
    for a, b in pairwise(times):
        n = math.ceil((b - a) * u / DEEPEST)
        parts += [np.linspace(a, b, n + 1)] if n > 1 else []
    return np.unique(np.concatenate(parts))


def _squares(scene: Scene, times: Array, states: Array) -> float:
    """Integral of (weight times component)^2, summed, back from a crossing at the last time."""
    c = scene.c

    def backward(y: Scalar, _: Any) -> list[Any]:
        # Cotangents obey the transposed equations with the opposite sign.
        back = (-sum(w * s for w, s in zip(y[6:], x, strict=True)) for x in jacobian(y[:6], c))
        return [*aligned(y[:6], c), *back]

    # As in a Newton step: a deviation of M3 shifts the crossing by that over -M3'.
    weights = np.array([0, 0, -scene.rate / aligned(states[:, -1], c)[2], 0, 0, 0])
    total = 0.0
    for k in range(times.size - 1, 0, -1):
        span = times[k] - times[k - 1]
        grid = np.linspace(0.0, -span, max(8, math.ceil(span * scene.u / SAMPLES)))
        # The weights go on from piece to piece, the orbit from where it was forwards.
        start = np.r_[states[:, k], weights]
        y = states_at(backward, start, grid, tolerance=TOLERANCE)
        total += ((y[:6] * y[6:]) ** 2).sum(axis=0).mean() * span
        weights = y[6:, -1]
    return total


def growths(scene: Scene, state: Array, until: float) -> tuple[Array, Array]:
    """Crossing times of an orbit, and ln of how much a small error of the phase has grown there.

    The orbit is followed to t' = `until`; both are (k,) arrays, and the growth at the first
    crossing is 0.
    """
    c = scene.c
    times = np.arange(0.0, until, SAMPLES / scene.u)
    # A shift of the phase: M is nearly along Oz at the start, and gamma turns about that axis.
    direction = np.array([0.0, 0.0, 0.0, -state[4], state[3], 0.0])
    start, field = np.r_[state, direction], with_tangent(c)
    y = states_at(field, start, times, tolerance=TOLERANCE)
    M3 = y[2]
    k = np.flatnonzero(M3[:-1] * M3[1:] < 0)
    share = M3[k] / (M3[k] - M3[k + 1])
    shift = (y[8, k] + share * (y[8, k + 1] - y[8, k])) / aligned(y[:6, k], c)[2]
    logarithm = np.log(np.abs(shift))
    return times[k] + share * (times[k + 1] - times[k]), logarithm - logarithm[:1]


def with_tangent(c: AlignedCoefficients) -> Callable[[Any, Any], list[Any]]:
    """The aligned field of 12 components: an orbit, and a small deviation from it."""

    def field(y: Scalar, _: Any) -> list[Any]:
        rows = zip(*jacobian(y[:6], c), strict=True)
        along = (sum(s * v for s, v in zip(row, y[6:], strict=True)) for row in rows)
        return [*aligned(y[:6], c), *along]

    return field


def jacobian(x: Numbers, c: AlignedCoefficients) -> list[list[Any]]:
    """Derivatives of the aligned field along each axis: six columns of six.

    The field is quadratic, so that half the difference between two points on either side of x is
    the derivative there, at any distance: here one.
    """
    columns = []
    for j in range(6):
        ahead, behind = ([a + side * (i == j) for i, a in enumerate(x)] for side in (1.0, -1.0))
        both = zip(aligned(ahead, c), aligned(behind, c), strict=True)
        columns.append([(a - b) / 2 for a, b in both])
    return columns


def compared(
    scene: Scene, states: Array, n_crossings: int, limit: float
) -> tuple[Array, Array, Array]:
    """Phase errors of doubles, against 113 bits, and as predicted, and the last bit of the times.

    All are in radians, (n_crossings, n); each passage may take t' = `limit`.
    """
    orbits = Orbits(scene.c, states, n_crossings, limit)
    # The truth of the very same doubles: what rounds their starts is no error of integration.
    found, true = followed(scene, orbits), followed(scene, orbits, BITS)
    predicted = predicted_errors(scene, states, true.time)
    floor = scene.rate * np.spacing(true.time)
    return phase_errors(found, true, scene.rate), predicted, floor


def decided(errors: Array, limit: float) -> int:
    """Count the decided symbols: crossings behind the first, up to an error beyond `limit`."""
    beyond = errors > limit
    return max(0, int(beyond.argmax()) - 1 if beyond.any() else errors.size - 1)
