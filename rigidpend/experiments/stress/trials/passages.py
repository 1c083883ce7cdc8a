"""Trials of the growth of errors from passage to passage, and of the symbols that it decides.

Both are predicted first: `growth` carries roundings along the orbit by the variational
equations; nothing is fitted.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.data import layout
from rigidpend.experiments.data.tree import Dataset
from rigidpend.experiments.stress.layout import DECIDED, GROWTH
from rigidpend.experiments.stress.trials import growth, scenes
from rigidpend.experiments.stress.trials.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.trials.growth import compared
from rigidpend.experiments.stress.trials.scenes import Place, Scene, Way, at_random
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.generic import Scalar
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.surfaces.melnikov import whisker_growth

FACTOR = 3.0
"""Allowed factor between a measured error and the predicted one."""
SIGMAS = 4.0
"""Standard errors within which two means, or two medians, are equal."""
LOG_NORMAL = math.pi / math.sqrt(8)
"""Standard deviation of the logarithm of the size of a normal error."""
LOG_PASSAGE = math.pi / 2
"""Standard deviation of ln of the growth a passage, if phases were random.

It is that of ln of the size of a Cauchy variable, see `melnikov.whisker_growth`."""
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


class Fan(NamedTuple):
    """Orbits of one body on separatrix 2 with random phases."""

    scene: Scene
    J1: float
    seed: int

    def phases(self, n: int) -> Array:
        """Phases theta2_0 of n orbits."""
        return np.random.default_rng(self.seed).uniform(0, 2 * np.pi, n)

    def states(self, n: int) -> Array:
        """Their aligned components, (6, n)."""
        place = Place("", 2, self.J1, self.scene.J2 - self.J1)
        return at_random(place, self.scene.body, n, self.seed)


def growth_trial(fan: Fan, way: Way, *, orbits: int, n_crossings: int) -> Trial:
    """Errors of doubles at each crossing, measured against 113 bits, and predicted."""
    scene = fan.scene

    def measure() -> Findings:
        given = fan.states(orbits), n_crossings, 500 / scene.u, way
        measured, predicted, floor = compared(scene, *given)
        slopes = np.array([slopes_of(x) for x in (measured, predicted)])
        rms = np.sqrt(((measured / predicted) ** 2).mean(axis=1))
        values = [np.maximum(rms, 1 / rms).max(), abs((slopes[0] - slopes[1]).mean())]
        floor = floor.mean(axis=1)
        curves = _growth_curves(measured, predicted, slopes, floor, scene.body.nu)
        return Findings(values, curves)

    return Trial("growth", growth_claims(orbits, n_crossings), measure)


def growth_claims(orbits: int, n_crossings: int) -> tuple[Claim, Claim]:
    """The claims on the size of errors and on their growth."""
    return (
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


def slope_spread(orbits: int, n_crossings: int) -> float:
    """`SIGMAS` standard errors of the mean slope of so many orbits' logarithms of errors."""
    number = np.arange(SETTLED, n_crossings)
    return float(SIGMAS * LOG_NORMAL / math.sqrt(orbits * number.size * number.var()))


def _growth_curves(
    measured: Array, predicted: Array, slopes: Array, floor: Array, nu: float
) -> dict[str, Dataset]:
    a_passage = np.exp(slopes.mean(axis=1))
    return layout.datasets(
        GROWTH,
        {
            "crossing": np.arange(len(measured)),
            "measured": np.exp(_typical(measured)),
            "predicted": GEOMETRIC * np.exp(_typical(predicted)),
            "floor": floor,
            "scatter": measured,
            "growth_measured": a_passage[0],
            "growth_predicted": a_passage[1],
            "growth_whisker": whisker_growth(nu),
        },
    )


def slopes_of(errors: Array) -> Array:
    """ln of the growth a passage of each orbit, where times in doubles can tell its errors."""
    number = np.arange(SETTLED, len(errors))
    return np.asarray(np.polyfit(number, np.log(np.maximum(errors[SETTLED:], 2.0**-53)), 1)[0])


def _typical(errors: Array) -> Array:
    """The mean logarithm; what rounds to no error counts as half a unit in the last place of 1."""
    return np.asarray(np.log(np.maximum(errors, 2.0**-53)).mean(axis=1))


def decided_trial(
    fan: Fan,
    way: Way,
    bits: int,
    *,
    h0: Scalar,
    columns: int,
    checked: int,
    n_symbols: int,
    tangents: int,
) -> Trial:
    """Trial of the number of symbols that one precision decides alone, predicted and measured.

    Parameters
    ----------
    fan : Fan
    way : Way
    bits : int
    h0 : number
        Energy constant that belongs to the fan's J2.
    columns, checked : int
        Orbits, and how many of them are held against a higher precision.
    n_symbols : int
        More than the precision can decide.
    tangents : int
        Orbits of which the growth is taken.
    """
    body = fan.scene.body
    claims = [agreement(bits, columns, tangents, body.nu)]
    claims += [contradicted(bits, checked)] if checked else []

    def measure() -> Findings:
        # Predicted before anything is measured.
        predicted = predicted_symbols(fan, bits, n_symbols, tangents, way.engine)
        common: dict[str, Any] = {"h0": h0, "J1_0": fan.J1, "n_symbols": n_symbols}
        common["jobs"], phases = way.jobs, fan.phases(columns)
        found = route_codes(body, phases, precisions=(bits,), engine=way.engine, **common)
        decided = found.certain.sum(axis=0)
        middle = [float(np.median(x)) for x in (decided, predicted)]
        values = [abs(middle[0] - middle[1])]
        if checked:
            values.append(_wrong(fan, found, phases[:checked], way.engine, common))
        said = f"{middle[0]:g} measured, {middle[1]:g} predicted"
        told = {"bits": bits, "measured": decided, "predicted": predicted, "asked": n_symbols}
        return Findings(values, layout.datasets(DECIDED, told), [said])

    return Trial(f"{bits} bits", tuple(claims), measure)


def finer(bits: int) -> int:
    """The precision that judges what `bits` bits decide: half as many bits again at least."""
    return scenes.BITS if 3 * bits <= 2 * scenes.BITS else 2 * bits


def _wrong(fan: Fan, found: RouteCodes, phases: Array, engine: str, common: Any) -> float:
    """Symbols that are called certain and that a higher precision contradicts."""
    bits = finer(int(found.bits[0]))
    # Above 113 bits integers compute: they share no arithmetic with what they judge.
    arithmetic = engine if bits == scenes.BITS else "scipy"
    known = route_codes(fan.scene.body, phases, precisions=(bits,), engine=arithmetic, **common)
    differ = found.codes[:, : phases.size] != known.codes
    return float((found.certain[:, : phases.size] & differ).sum())


def predicted_symbols(
    fan: Fan, bits: int, n_symbols: int, tangents: int, engine: str
) -> NDArray[np.int64]:
    """Symbols that a precision decides on each of some orbits, from the variational equations.

    The error at crossing `LEVEL` is carried on by a tangent vector. Two computations that round
    independently differ by sqrt(2) times it.
    """
    scene, body = fan.scene, fan.scene.body
    until = n_symbols * passage(body.angles().mu / (body.kappa * scene.J2**2 / 2)) / scene.u
    numbers = []
    for x in fan.states(tangents).T:
        times, grown = growth.growths(scene, x, until, engine)
        first = x[:, None], times[: LEVEL + 1, None]
        there = growth.predicted_errors(scene, *first, "taylor")[-1, 0]
        # In other precisions roundings are larger or smaller, and what becomes of them is the same.
        difference = math.sqrt(2) * there * np.exp(grown - grown[LEVEL]) * 2.0 ** (53 - bits)
        numbers.append(growth.decided(difference[: n_symbols + 1], UNDECIDED))
    return np.array(numbers)


def passage(weight: float) -> float:
    """A mean passage in units of 1/u, at most: from a distance mu/h0 to one and back, and more."""
    return 2 * math.log(1 / weight) + 8


def agreement(bits: int, columns: int, tangents: int, nu: float) -> Claim:
    """The claim that as many symbols are decided as predicted."""
    return Claim(
        f"decided by {bits} bits",
        median_spread(bits, columns, tangents, nu) + LEVEL_ERROR,
        "difference of the median numbers of symbols decided, measured and predicted",
        "four standard errors of two medians of first passages of a random walk, whose step is"
        " the growth a passage, and one symbol for a factor two of the level",
        "symbols",
    )


def median_spread(bits: int, columns: int, tangents: int, nu: float) -> float:
    """`SIGMAS` standard errors of the difference of two medians of numbers decided.

    An error grows from 2^-bits to one as a random walk of its logarithm, of mean step g and
    deviation `LOG_PASSAGE`; it takes n = bits ln 2/g passages, give or take LOG_PASSAGE sqrt(n)/g.
    """
    g = math.log(whisker_growth(nu))
    deviation = LOG_PASSAGE * math.sqrt(bits * math.log(2) / g) / g
    return SIGMAS * deviation * math.sqrt(math.pi / 2 * (1 / columns + 1 / tangents))


def contradicted(bits: int, checked: int) -> Claim:
    """The claim that more bits contradict nothing that is decided."""
    return Claim(
        f"decided by {bits} bits, wrong",
        0,
        f"symbols that {finer(bits)} bits contradict, on {checked} orbits",
        "what two computations establish is right",
    )
