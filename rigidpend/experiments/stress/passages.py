"""Growth of errors from passage to passage, and the number of symbols decided, predicted first.

Every step of an integrator rounds every component once. The variational equations propagate these
roundings along the orbit; they are independent, so their squares add. Nothing is fitted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.stress import scenes
from rigidpend.experiments.stress.scenes import (
    TRUTH_BITS,
    Claim,
    Findings,
    Scene,
    Trial,
    followed,
    random_phases,
)
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_along
from rigidpend.numbers.generic import Array, Scalar
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.codes import RouteCodes
from rigidpend.routes.problem import RouteProblem, whisker_growth

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

FACTOR = 3.0
"""Allowed factor between a measured error and the predicted one."""
SIGMAS = 4.0
"""Standard errors within which two means, or two medians, count as equal."""
LOG_NORMAL = math.pi / math.sqrt(8)
"""Standard deviation of the logarithm of the size of a normal error."""
LOG_PASSAGE = math.pi / 2
"""Standard deviation of ln of the growth in a passage, if phases were random.

It is that of ln|x| for a Cauchy variable x; see `routes.problem.whisker_growth`."""
UNDECIDED = 1e-3
"""Difference of two computations, radians, above which they no longer decide a symbol."""
GEOMETRIC = math.exp(-(np.euler_gamma + math.log(2)) / 2)
"""Geometric mean of the size of a normal error over its root mean square."""
SETTLED = 3
"""Crossing from which on errors exceed the rounding of a time in doubles."""
LEVEL = 5
"""Crossing up to which roundings are summed; from there on the sum grows like any error."""
LEVEL_ERROR = 1.0
"""Shift of the predicted number of symbols by a factor two in the size of roundings."""
SYMBOLS_PER_BIT = 1.5
"""Number of symbols computed per bit, so that no precision decides all of them."""


def step(u: float) -> float:
    """The step of a Taylor integrator in t', near separatrices of exponent u.

    On them J1 = J2/(exp(-u t' + v) + 1) has its poles pi/u off the real axis.
    """
    return SHARE * math.pi / u


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
    Six vectors, a square root of the covariance, are propagated; in each step six vectors of
    roundings join, and a QR factorisation reduces twelve to six. The covariance itself would lose
    its small parts to rounding.
    """
    field, (_, n) = with_tangent(scene.c), states.shape
    times = np.linspace(0.0, end, 2 + int(abs(end) / step(scene.u)))
    found, vectors = [(states, np.zeros(states.shape))], np.zeros((6, 6, n))
    for _ in times[1:]:
        # One integration carries each orbit with each of its six vectors: 12 rows, 6 n columns.
        here = np.broadcast_to(states[:, None], vectors.shape)
        start = np.concatenate((here, vectors)).reshape(12, -1)
        y = states_at(field, start, times[1:2])[:, 0].reshape(12, 6, n)
        states = y[:6, 0]
        # Axes are component, vector, orbit: six old vectors, and a rounding of each component.
        twelve = np.concatenate((y[6:], NOISE * states * np.eye(6)[:, :, None]), axis=1)
        # With the vectors of an orbit as rows of V, R^T R = V^T V: the covariance stays the same.
        triangle: Any = np.linalg.qr(twelve.transpose(2, 1, 0), mode="r")
        vectors = triangle.transpose(2, 1, 0)
        found.append((states, np.linalg.norm(vectors, axis=1)))
    orbits, errors = np.array(found).swapaxes(0, 1)
    return times, orbits, errors


def growths(scene: Scene, state: Array, until: float) -> tuple[Array, Array]:
    """Crossing times of an orbit, and the logarithm of the growth of a small phase error there.

    The orbit is followed to t' = `until`; both are (k,) arrays, and the logarithm at the first
    crossing is 0.
    """
    times = np.arange(0.0, until, SAMPLES / scene.u)
    # A shift of the phase: M is nearly along Oz at the start, and gamma turns about that axis.
    start = np.r_[state, 0.0, 0.0, 0.0, -state[4], state[3], 0.0]
    y = states_at(with_tangent(scene.c), start, times, tolerance=TOLERANCE)
    M3 = y[2]
    k = np.flatnonzero(M3[:-1] * M3[1:] < 0)
    # Between samples M3 and its deviation are taken as linear, which is enough for a prediction.
    share = M3[k] / (M3[k] - M3[k + 1])
    shift = (y[8, k] + share * (y[8, k + 1] - y[8, k])) / aligned(y[:6, k], scene.c)[2]
    logarithm = np.log(np.abs(shift))
    return times[k] + share * (times[k + 1] - times[k]), logarithm - logarithm[:1]


def with_tangent(c: AlignedCoefficients) -> Callable[[Any], list[Any]]:
    """The aligned field of 12 components: an orbit, and a small deviation from it.

    Over many passages the deviation grows by more digits than doubles have, so that a difference
    of orbits, as in `routes.symbolic.stretching`, would leave the orbit.
    """

    def field(y: Scalar) -> list[Any]:
        # The derivative of the field in a direction is linear in it: a sum of those along the axes.
        columns = (aligned_along(y[:6], axis, c) for axis in np.eye(6).tolist())
        rows = zip(*columns, strict=True)
        along = (sum(s * v for s, v in zip(row, y[6:], strict=True)) for row in rows)
        return [*aligned(y[:6], c), *along]

    return field


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
    return scenes.phase_errors(found, true, scene.rate), predicted, floor


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """Trials of the growth of errors, and of the symbols that each precision decides."""
    sizes, scene = asked.passages, scenes.of_problem(asked, jobs)
    yield growth_trial(scene, float(asked.J1_0), sizes.orbits, sizes.n_crossings)
    for bits, columns in sizes.columns.items():
        # More symbols than the precision can decide.
        n = round(SYMBOLS_PER_BIT * int(bits))
        problem = RouteProblem(asked.body, asked.h0, asked.J1_0, n)
        checked = sizes.checked.get(bits, 0)
        yield decided_trial(scene, problem, int(bits), columns, checked, sizes.orbits)


def growth_trial(scene: Scene, J1: float, orbits: int, n_crossings: int) -> Trial:
    """Trial of the errors of doubles at each crossing, measured against 113 bits and predicted."""

    def measure() -> Findings:
        given = scene.starts(orbits, J1), n_crossings, 500 / scene.u
        measured, predicted, floor = compared(scene, *given)
        slopes = np.array([slopes_of(x) for x in (measured, predicted)])
        # Each error over its own prediction, so that no single orbit dominates the mean.
        rms = np.sqrt(((measured / predicted) ** 2).mean(axis=1))
        growth = np.exp(slopes.mean(axis=1))
        curve = {
            "crossing": np.arange(len(measured)),
            "measured": np.exp(_logarithm(measured).mean(axis=1)),
            "predicted": GEOMETRIC * np.exp(_logarithm(predicted).mean(axis=1)),
            "floor": floor.mean(axis=1),
            "scatter": measured,
            "growth_measured": growth[0],
            "growth_predicted": growth[1],
        }
        values = [np.maximum(rms, 1 / rms).max(), abs((slopes[0] - slopes[1]).mean())]
        return values, curve

    claims = (
        Claim(
            "size of errors",
            FACTOR,
            "measured over predicted error, or its inverse: the largest of all crossings",
            "one rounding of each component a step is counted, and series add some more",
        ),
        Claim(
            "growth a passage",
            slope_spread(orbits, n_crossings),
            "difference of measured and predicted ln of the growth a passage",
            "four standard errors of the mean slope, were each orbit's errors normal ones that"
            " know nothing of each other",
        ),
    )
    return Trial("passages", "growth", claims, measure)


def slope_spread(orbits: int, n_crossings: int) -> float:
    """`SIGMAS` standard errors of the mean slope of so many orbits' logarithms of errors."""
    number = np.arange(SETTLED, n_crossings)
    # The standard error of a fitted slope, sigma/sqrt(n var x), averaged over the orbits.
    return float(SIGMAS * LOG_NORMAL / math.sqrt(orbits * number.size * number.var()))


def slopes_of(errors: Array) -> Array:
    """Mean ln of the growth per passage of each orbit, from crossings with resolvable errors."""
    number = np.arange(SETTLED, len(errors))
    return np.asarray(np.polyfit(number, _logarithm(errors[SETTLED:]), 1)[0])


def _logarithm(errors: Array) -> Array:
    # An error that rounds to 0 counts as half a unit in the last place of 1.
    return np.asarray(np.log(np.maximum(errors, 2.0**-53)))


def decided_trial(
    scene: Scene, problem: RouteProblem, bits: int, columns: int, checked: int, tangents: int
) -> Trial:
    """Trial of the number of symbols that one precision decides alone, predicted and measured.

    `columns` is the number of orbits, of which `checked` are compared with a higher precision, and
    `tangents` the number of orbits from which the growth is predicted.
    """
    claims = [
        Claim(
            f"decided by {bits} bits",
            median_spread(bits, columns, tangents, scene.body.nu) + LEVEL_ERROR,
            "difference of the median numbers of symbols decided, measured and predicted",
            "four standard errors of two medians of first passages of a random walk, whose step is"
            " the growth a passage, and one symbol for a factor two of the level",
            "symbols",
        )
    ]
    if checked:
        measured = f"symbols that {finer(bits)} bits contradict, on {checked} orbits"
        right = "what two computations establish is right"
        claims.append(Claim(f"decided by {bits} bits, wrong", 0, measured, right))

    def measure() -> Findings:
        # Predicted before anything is measured.
        predicted = predicted_symbols(scene, problem, bits, tangents)
        phases = random_phases(columns, scene.seed)
        found = scenes.routes(problem, phases, scene.jobs, (bits,))
        decided = found.certain.sum(axis=0)
        values = [abs(float(np.median(decided) - np.median(predicted)))]
        values += [_wrong(problem, found, phases[:checked], scene.jobs)] if checked else []
        return values, {"bits": bits, "measured": decided, "predicted": predicted}

    return Trial("passages", f"{bits} bits", claims, measure)


def finer(bits: int) -> int:
    """The precision that judges symbols decided in `bits` bits: at least 1.5 times as many."""
    return TRUTH_BITS if 3 * bits <= 2 * TRUTH_BITS else 2 * bits


def _wrong(problem: RouteProblem, found: RouteCodes, phases: Array, jobs: int) -> float:
    """Number of symbols called certain that a higher precision contradicts."""
    bits = finer(int(found.bits[0]))
    # Above 113 bits integers judge, which share no arithmetic with the kernel.
    engine = "taylor" if bits == TRUTH_BITS else "scipy"
    known = scenes.routes(problem, phases, jobs, (bits,), engine=engine)
    differ = found.codes[:, : phases.size] != known.codes
    return float((found.certain[:, : phases.size] & differ).sum())


def predicted_symbols(
    scene: Scene, problem: RouteProblem, bits: int, tangents: int
) -> NDArray[np.int64]:
    """Predicted number of symbols that a precision decides on each of some orbits.

    A tangent vector propagates the error at crossing `LEVEL`. Two computations that round
    independently differ by sqrt(2) times this error.
    """
    n = problem.n_symbols
    # Upper bound of a mean passage, in 1/u: from a distance mu/h0 to one and back, and a margin.
    passage = 2 * math.log(scene.h0 / scene.body.angles().mu) + 8
    starts = scene.starts(tangents, float(problem.J1_0))
    each = [growths(scene, x, n * passage / scene.u) for x in starts.T]
    known = np.stack([times[: LEVEL + 1] for times, _ in each], axis=1)
    numbers = []
    for there, (_, grown) in zip(predicted_errors(scene, starts, known)[-1], each, strict=True):
        # Other precisions only scale the roundings: their growth is the same.
        difference = math.sqrt(2) * there * np.exp(grown - grown[LEVEL]) * 2.0 ** (53 - bits)
        numbers.append(decided(difference[: n + 1]))
    return np.array(numbers)


def decided(differences: Array) -> int:
    """Count the decided symbols: crossings after the first, as long as computations agree."""
    # Symbol i ends at crossing i, counted from 0: a first disagreement at k leaves k - 1 symbols.
    beyond = differences > UNDECIDED
    return max(0, int(beyond.argmax()) - 1 if beyond.any() else differences.size - 1)


def median_spread(bits: int, columns: int, tangents: int, nu: float) -> float:
    """`SIGMAS` standard errors of the difference of two medians of numbers decided.

    The logarithm of an error grows from -bits ln 2 to 0 in a random walk with mean step g and
    deviation `LOG_PASSAGE`, in n = bits ln 2/g passages with a deviation of LOG_PASSAGE sqrt(n)/g.
    """
    g = math.log(whisker_growth(nu))
    deviation = LOG_PASSAGE * math.sqrt(bits * math.log(2) / g) / g
    # The variance of a median of n normal values is pi/2 of that of their mean.
    return SIGMAS * deviation * math.sqrt(math.pi / 2 * (1 / columns + 1 / tangents))
