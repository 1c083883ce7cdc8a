"""Growth of errors from passage to passage, and the number of symbols decided, predicted first."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.stress import scenes
from rigidpend.experiments.stress.roundings import compared, growths, predicted_errors
from rigidpend.experiments.stress.scenes import (
    SIGMAS,
    TRUTH_BITS,
    Claim,
    Findings,
    Scene,
    Trial,
    random_phases,
)
from rigidpend.experiments.stress.schema import Passages, Precision
from rigidpend.numbers import Array
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.codes import RouteCodes
from rigidpend.routes.problem import RouteProblem, whisker_growth

FACTOR = 3.0
"""Allowed factor between a measured error and the predicted one."""
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


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """Trials of the growth of errors, and of the symbols that each precision decides."""
    sizes, scene = asked.passages, scenes.of_problem(asked, jobs)
    yield growth_trial(scene, float(asked.J1_0), sizes)
    for precision in sizes.columns:
        # More symbols than the precision can decide.
        n = round(SYMBOLS_PER_BIT * int(precision))
        problem = RouteProblem(asked.body, asked.h0, asked.J1_0, n)
        yield decided_trial(scene, problem, precision, sizes)


def growth_trial(scene: Scene, J1: float, sizes: Passages) -> Trial:
    """Trial of the errors of doubles at each crossing, measured against 113 bits and predicted."""
    claims = (
        Claim(
            "size of errors",
            FACTOR,
            "measured over predicted error, or its inverse: the largest of all crossings",
            "one rounding of each component a step is counted, and series add some more",
        ),
        Claim(
            "growth a passage",
            slope_spread(sizes.orbits, sizes.n_crossings),
            "difference of measured and predicted ln of the growth a passage",
            "four standard errors of the mean slope, were each orbit's errors normal ones that"
            " know nothing of each other",
        ),
    )

    def measure() -> Findings:
        starts = scene.starts(sizes.orbits, J1)
        measured, predicted, floor = compared(scene, starts, sizes.n_crossings, 500 / scene.u)
        # Each error over its own prediction, so that no single orbit dominates the mean.
        rms = np.sqrt(((measured / predicted) ** 2).mean(axis=1))
        slopes = np.array([slopes_of(measured), slopes_of(predicted)])
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
        return [np.maximum(rms, 1 / rms).max(), abs((slopes[0] - slopes[1]).mean())], curve

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
    scene: Scene, problem: RouteProblem, precision: Precision, sizes: Passages
) -> Trial:
    """Trial of the number of symbols that one precision decides alone, predicted and measured.

    It is predicted from other orbits, as many as those of the growth.
    """
    bits, columns = int(precision), sizes.columns[precision]
    checked = sizes.checked.get(precision, 0)
    claims = [
        Claim(
            f"decided by {bits} bits",
            median_spread(bits, columns, sizes.orbits, scene.body.nu) + LEVEL_ERROR,
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
        predicted = predicted_symbols(scene, problem, bits, sizes.orbits)
        phases = random_phases(columns, scene.seed)
        found = scenes.routes(problem, phases, resolve(precisions=(bits,)), scene.jobs)
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
    known = scenes.routes(problem, phases, resolve(engine, None, (bits,)), jobs)
    differ = found.codes[:, : phases.size] != known.codes
    return float((found.certain[:, : phases.size] & differ).sum())


def predicted_symbols(
    scene: Scene, problem: RouteProblem, bits: int, orbits: int
) -> NDArray[np.int64]:
    """Predicted number of symbols that a precision decides on each of some orbits.

    The error at crossing `LEVEL` is that of doubles, scaled; from there on a tangent vector
    propagates it.
    """
    n = problem.n_symbols
    # Upper bound of a mean passage, in 1/u: from a distance mu/h0 to one and back, and a margin.
    passage = 2 * math.log(scene.h0 / scene.body.angles().mu) + 8
    starts = scene.starts(orbits, float(problem.J1_0))
    each = [growths(scene, x, n * passage / scene.u) for x in starts.T]
    known = np.stack([times[: LEVEL + 1] for times, _ in each], axis=1)
    level = predicted_errors(scene, starts, known)[-1]
    # Two computations that round independently differ by sqrt(2) times the error of one.
    apart = math.sqrt(2) * level * 2.0 ** (53 - bits)
    grown = [np.exp(logarithm - logarithm[LEVEL])[: n + 1] for _, logarithm in each]
    return np.array([decided(x * factor) for x, factor in zip(apart, grown, strict=True)])


def decided(differences: Array) -> int:
    """Count the decided symbols: crossings after the first, as long as computations agree."""
    # Symbol i ends at crossing i, counted from 0: a first disagreement at k leaves k - 1 symbols.
    beyond = differences > UNDECIDED
    return max(0, int(beyond.argmax()) - 1 if beyond.any() else differences.size - 1)


def median_spread(bits: int, columns: int, others: int, nu: float) -> float:
    """`SIGMAS` standard errors of the difference of the medians of two sets of orbits.

    The logarithm of an error grows from -bits ln 2 to 0 in a random walk with mean step g and
    deviation `LOG_PASSAGE`, in n = bits ln 2/g passages with a deviation of LOG_PASSAGE sqrt(n)/g.
    """
    g = math.log(whisker_growth(nu))
    deviation = LOG_PASSAGE * math.sqrt(bits * math.log(2) / g) / g
    # The variance of a median of n normal values is pi/2 of that of their mean.
    return SIGMAS * deviation * math.sqrt(math.pi / 2 * (1 / columns + 1 / others))
