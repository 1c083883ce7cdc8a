"""Trials of the growth of errors from passage to passage, and of the symbols that it decides.

Both are predicted first: `growth` carries roundings along the orbit by the variational
equations; nothing is fitted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.stress import DECIDED, GROWTH, growth, scenes
from rigidpend.experiments.stress.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.growth import compared
from rigidpend.experiments.stress.scenes import Scene, random_phases
from rigidpend.numbers.generic import Array
from rigidpend.routes.codes import RouteCodes
from rigidpend.routes.problem import RouteProblem, whisker_growth

FACTOR = 3.0
"""Allowed factor between a measured error and the predicted one."""
SIGMAS = 4.0
"""Standard errors within which two means, or two medians, are equal."""
LOG_NORMAL = math.pi / math.sqrt(8)
"""Standard deviation of the logarithm of the size of a normal error."""
LOG_PASSAGE = math.pi / 2
"""Standard deviation of ln of the growth a passage, if phases were random.

It is that of ln of the size of a Cauchy variable, see `routes.problem.whisker_growth`."""
UNDECIDED = 1e-3
"""Radians by which two computations differ where a symbol is no longer decided by them."""
GEOMETRIC = math.exp(-(np.euler_gamma + math.log(2)) / 2)
"""The geometric mean of the size of a normal error over its root mean square."""
SETTLED = 3
"""The crossing from which on errors exceed what a time in doubles can hold."""
LEVEL = 5
"""The crossing up to which roundings are added up; then they grow like any error."""
LEVEL_ERROR = 1.0
"""Symbols by which a factor two in the size of roundings shifts the prediction."""
SYMBOLS_PER_BIT = 1.5
"""Number of symbols that are asked for per bit, so that no precision decides all."""

SIZE = "measured over predicted error, or its inverse: the largest of all crossings"
COUNTED = "one rounding of each component a step is counted, and series add some more"
SLOPE = "difference of measured and predicted ln of the growth a passage"
NORMAL = (
    "four standard errors of the mean slope, were each orbit's errors normal ones that"
    " know nothing of each other"
)
MEDIANS = "difference of the median numbers of symbols decided, measured and predicted"
WALKS = (
    "four standard errors of two medians of first passages of a random walk, whose step is"
    " the growth a passage, and one symbol for a factor two of the level"
)
RIGHT = "what two computations establish is right"


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """The growth of errors, and what each precision decides."""
    sizes, scene = asked.passages, scenes.of_problem(asked, jobs)
    yield growth_trial(scene, float(asked.J1_0), sizes.orbits, sizes.n_crossings)
    for bits, columns in sizes.columns.items():
        # More symbols than the precision can decide.
        n = round(SYMBOLS_PER_BIT * int(bits))
        problem = RouteProblem(asked.body, asked.h0, asked.J1_0, n)
        checked = sizes.checked.get(bits, 0)
        yield decided_trial(scene, problem, int(bits), columns, checked, sizes.orbits)


def growth_trial(scene: Scene, J1: float, orbits: int, n_crossings: int) -> Trial:
    """Errors of doubles at each crossing, measured against 113 bits, and predicted."""

    def measure() -> Findings:
        given = scene.starts(orbits, J1), n_crossings, 500 / scene.u
        measured, predicted, floor = compared(scene, *given)
        slopes = np.array([slopes_of(x) for x in (measured, predicted)])
        rms = np.sqrt(((measured / predicted) ** 2).mean(axis=1))
        a_passage = np.exp(slopes.mean(axis=1))
        curves = {
            "crossing": np.arange(len(measured)),
            "measured": np.exp(_typical(measured)),
            "predicted": GEOMETRIC * np.exp(_typical(predicted)),
            "floor": floor.mean(axis=1),
            "scatter": measured,
            "growth_measured": a_passage[0],
            "growth_predicted": a_passage[1],
            "growth_whisker": whisker_growth(scene.body.nu),
        }
        values = [np.maximum(rms, 1 / rms).max(), abs((slopes[0] - slopes[1]).mean())]
        return Findings(values, curves=curves)

    claims = (
        Claim("size of errors", FACTOR, SIZE, COUNTED),
        Claim("growth a passage", slope_spread(orbits, n_crossings), SLOPE, NORMAL),
    )
    return Trial("passages", "growth", claims, measure, GROWTH)


def slope_spread(orbits: int, n_crossings: int) -> float:
    """`SIGMAS` standard errors of the mean slope of so many orbits' logarithms of errors."""
    number = np.arange(SETTLED, n_crossings)
    return float(SIGMAS * LOG_NORMAL / math.sqrt(orbits * number.size * number.var()))


def slopes_of(errors: Array) -> Array:
    """ln of the growth a passage of each orbit, where times in doubles can tell its errors."""
    number = np.arange(SETTLED, len(errors))
    return np.asarray(np.polyfit(number, np.log(np.maximum(errors[SETTLED:], 2.0**-53)), 1)[0])


def _typical(errors: Array) -> Array:
    """The mean logarithm; what rounds to no error counts as half a unit in the last place of 1."""
    return np.asarray(np.log(np.maximum(errors, 2.0**-53)).mean(axis=1))


def decided_trial(
    scene: Scene, problem: RouteProblem, bits: int, columns: int, checked: int, tangents: int
) -> Trial:
    """Trial of the number of symbols that one precision decides alone, predicted and measured.

    Of so many `columns`, some are `checked` by a higher precision; `tangents` are the orbits of
    which the growth is taken.
    """
    spread = median_spread(bits, columns, tangents, scene.body.nu) + LEVEL_ERROR
    claims = [Claim(f"decided by {bits} bits", spread, MEDIANS, WALKS, "symbols")]
    if checked:
        measured = f"symbols that {finer(bits)} bits contradict, on {checked} orbits"
        claims.append(Claim(f"decided by {bits} bits, wrong", 0, measured, RIGHT))

    def measure() -> Findings:
        # Predicted before anything is measured.
        predicted = predicted_symbols(scene, problem, bits, tangents)
        phases = random_phases(columns, scene.seed)
        found = scenes.routes(problem, phases, scene.jobs, (bits,))
        decided = found.certain.sum(axis=0)
        middle = [float(np.median(x)) for x in (decided, predicted)]
        values = [abs(middle[0] - middle[1])]
        values += [_wrong(problem, found, phases[:checked], scene.jobs)] if checked else []
        said = f"{middle[0]:g} measured, {middle[1]:g} predicted"
        numbers = {"measured": decided, "predicted": predicted, "asked": problem.n_symbols}
        return Findings(values, [said], {"bits": bits, **numbers})

    return Trial("passages", f"{bits} bits", claims, measure, DECIDED)


def finer(bits: int) -> int:
    """The precision that judges what `bits` bits decide: half as many bits again at least."""
    return scenes.BITS if 3 * bits <= 2 * scenes.BITS else 2 * bits


def _wrong(problem: RouteProblem, found: RouteCodes, phases: Array, jobs: int) -> float:
    """Symbols that are called certain and that a higher precision contradicts."""
    bits = finer(int(found.bits[0]))
    # Above 113 bits integers compute: they share no arithmetic with what they judge.
    engine = "taylor" if bits == scenes.BITS else "scipy"
    known = scenes.routes(problem, phases, jobs, (bits,), engine=engine)
    differ = found.codes[:, : phases.size] != known.codes
    return float((found.certain[:, : phases.size] & differ).sum())


def predicted_symbols(
    scene: Scene, problem: RouteProblem, bits: int, tangents: int
) -> NDArray[np.int64]:
    """Symbols that a precision decides on each of some orbits, from the variational equations.

    The error at crossing `LEVEL` is carried on by a tangent vector. Two computations that round
    independently differ by sqrt(2) times it.
    """
    n = problem.n_symbols
    until = n * passage(scene.body.angles().mu / scene.h0) / scene.u
    numbers = []
    for x in scene.starts(tangents, float(problem.J1_0)).T:
        times, grown = growth.growths(scene, x, until)
        there = growth.predicted_errors(scene, x[:, None], times[: LEVEL + 1, None])[-1, 0]
        # In other precisions roundings are larger or smaller, and what becomes of them is the same.
        difference = math.sqrt(2) * there * np.exp(grown - grown[LEVEL]) * 2.0 ** (53 - bits)
        numbers.append(growth.decided(difference[: n + 1], UNDECIDED))
    return np.array(numbers)


def passage(weight: float) -> float:
    """A mean passage in units of 1/u, at most: from a distance mu/h0 to one and back, and more."""
    return 2 * math.log(1 / weight) + 8


def median_spread(bits: int, columns: int, tangents: int, nu: float) -> float:
    """`SIGMAS` standard errors of the difference of two medians of numbers decided.

    An error grows from 2^-bits to one as a random walk of its logarithm, of mean step g and
    deviation `LOG_PASSAGE`; it takes n = bits ln 2/g passages, give or take LOG_PASSAGE sqrt(n)/g.
    """
    g = math.log(whisker_growth(nu))
    deviation = LOG_PASSAGE * math.sqrt(bits * math.log(2) / g) / g
    return SIGMAS * deviation * math.sqrt(math.pi / 2 * (1 / columns + 1 / tangents))
