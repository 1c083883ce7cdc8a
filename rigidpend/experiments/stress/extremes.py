"""Bodies, energies and starts at the ends of their ranges, against higher precision.

A route problem makes two claims: on the largest phase error of a certain symbol, which is the
promise of the package, and on the share of symbols left uncertain, which is its reach. A start on
or beside a separatrix, with any M . gamma, makes one: doubles err as the variational equations
predict. J1 and J2 - J1 are separate numbers, so that both may be as small as 1e-300.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.stress import scenes
from rigidpend.experiments.stress.roundings import DEVIATIONS, compared
from rigidpend.experiments.stress.scenes import Claim, Findings, Place, Scene, Trial
from rigidpend.mechanics.body import Body
from rigidpend.numbers import Array
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.codes import RouteCodes
from rigidpend.routes.problem import RouteProblem, phase_rate

PHASES = ("3/10", "29/10", "47/10", "7/5", "1/5", "6", "22/7", "13/4")
"""Initial phases theta2_0, radians, of no special kind."""
ERROR = 1e-2
"""Bound of phase errors, radians: a symbol changes at about 1, which leaves a wide margin."""


class Extreme(NamedTuple):
    """A route problem at the end of a range; by default the body of Fig. 4 elsewhere."""

    name: str
    A: tuple[str, ...] = ("2", "1", "3/2")
    r: tuple[str, ...] = ("1", "1", "0")
    mu: str = "1/1000"
    h0: str = "1.3342"
    J1_0: str = "1e-8"
    most_symbols: int = 15
    """Largest number of symbols; below 15, for long passages, also at most two orbits."""


GROUPS = {
    # Bodies with two nearly equal moments, flat or nearly spherical bodies, and special beta0.
    "bodies": (
        Extreme("A3 = A2 + 0.05", A=("1.5", "1", "1.05"), most_symbols=8),
        Extreme("A3 = A2 + 0.01", A=("1.5", "1", "1.01"), most_symbols=4),
        Extreme("A3 = A2 + 0.001", A=("1.5", "1", "1.001"), most_symbols=2),
        Extreme("A3 = A1 - 0.1", A=("2", "1", "1.9"), most_symbols=8),
        Extreme("A3 = A1 - 0.01", A=("2", "1", "1.99"), most_symbols=4),
        Extreme("A3 = A1 - 0.001", A=("2", "1", "1.999"), most_symbols=2),
        Extreme("flat", A=("2", "1/2", "3/2")),
        # nu is 157, and the surfaces split by exp(-157).
        Extreme("near-spherical, 2 %", A=("1.01", "0.99", "1"), most_symbols=2),
        Extreme("beta0 = 0", r=("1", "0", "0")),
        Extreme("beta0 = pi", r=("0", "1", "0")),
        Extreme("Hess", r=("1", "sqrt(2)", "0")),
        Extreme("Grioli", r=("1", "1", "0")),
    ),
    # Weights from zero to nearly h0, at which the pendulum nearly stops at the top.
    "energies": (
        Extreme("mu = 1e-60 h0", mu="1.3342e-60", most_symbols=2),
        Extreme("mu = 1e-90 h0", mu="1.3342e-90", most_symbols=2),
        *(
            Extreme(f"mu = {share} h0", mu=f"1.3342*{share}")
            for share in ("0", "1e-30", "1e-8", "1e-2", "0.1", "0.3", "0.6", "0.9")
        ),
        *(
            Extreme(f"h0 = mu (1 + {above})", mu="1.3342", h0=f"1.3342*(1 + {above})")
            for above in ("1e-3", "1e-6", "1e-12")
        ),
    ),
    # Ever closer to the lower periodic orbit.
    "lower_starts": tuple(
        Extreme(f"J1_0 = {J1}", J1_0=J1)
        for J1 in ("1e-2", "1e-4", "1e-6", "1e-12", "1e-16", "1e-32", "1e-64", "1e-100", "1e-300")
    ),
    # Ever closer to the upper one, where J2_0 - J1_0 is small.
    "upper_starts": tuple(
        Extreme(f"J2_0 - J1_0 = {J}", J1_0=f"sqrt(2*1.3342*3/4) - {J}")
        for J in ("1e-2", "1e-4", "1e-8", "1e-16", "1e-20", "1e-24", "1e-32", "1e-100", "1e-300")
    ),
}
"""Route problems, by kind."""

PLACES = (
    *(Place(f"on {k}, J1 = 1e-8", k, 1e-8, 1.4) for k in (1, 2, 3, 4)),
    *(Place(f"on {k}, J2 - J1 = 1e-8", k, 1.4, 1e-8) for k in (1, 2, 3, 4)),
    *(Place(f"beside {k} by 1e-3", k, 1e-4, 1.4, 1e-3) for k in (1, 2, 3, 4)),
    *(Place(f"beside {k} by -1e-9", k, 1e-4, 1.4, -1e-9) for k in (1, 2, 3, 4)),
    Place("on 2, J1 = 1e-300", 2, 1e-300, 1.4),
    Place("on 1, J2 - J1 = 1e-300", 1, 1.4, 1e-300),
    Place("M.gamma = 0.3", 2, 1e-4, 1.4, 0.0, 0.3),
    Place("M.gamma = 1.2", 4, 1e-3, 1.4, 1e-5, 1.2),
    Place("M.gamma = -0.999 |M|", 3, 1e-2, 1.4, 0.0, -0.999 * 1.41),
)
"""Starts on every separatrix near both its ends, beside it, and with M . gamma."""


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """Trials of every extreme, and of starts on and beside the separatrices."""
    sizes = asked.extremes
    for kind, members in GROUPS.items():
        for extreme in members:
            yield trial(kind, extreme, jobs, sizes.columns, sizes.n_symbols)
    for place in PLACES:
        yield start_trial(asked.body, place, jobs, sizes.columns, 5)


def trial(kind: str, extreme: Extreme, jobs: int, columns: int, n_symbols: int) -> Trial:
    """Trial of a route problem: both claims and their measurement."""
    phases = PHASES[: columns if extreme.most_symbols > 2 else min(columns, 2)]

    def measure() -> Findings:
        body, n = Body(extreme.A, extreme.r, extreme.mu), min(n_symbols, extreme.most_symbols)
        problem = RouteProblem(body, exact(extreme.h0), exact(extreme.J1_0), n)
        found = scenes.routes(problem, phases, resolve(), jobs)
        # Uncertain symbols may be wrong: only certain ones count.
        worst = np.max(_errors(problem, found, phases, jobs), where=found.certain, initial=0.0)
        return [worst, 1 - found.certain.mean()], {}

    claims = (
        Claim(
            f"{extreme.name}: error",
            ERROR,
            "largest phase error at a certain symbol, against"
            f" {scenes.TRUTH_BITS} or {scenes.INTEGER_BITS} bits",
            "a symbol turns over at about a radian; a hundredth is far from it",
            "rad",
        ),
        Claim(
            f"{extreme.name}: uncertain",
            0.0,
            "share of symbols that stay uncertain after the last precision",
            "160 bits outlast 15 passages, each of which triples an error",
        ),
    )
    return Trial(kind, extreme.name, claims, measure)


def _errors(problem: RouteProblem, found: RouteCodes, phases: tuple[str, ...], jobs: int) -> Array:
    """The phase error of each symbol, infinite for a wrong one, (n_symbols, n)."""
    errors = np.zeros(found.codes.shape)
    # Symbols that took 113 bits or more are compared with integers of more bits.
    exacting = found.bits >= scenes.TRUTH_BITS
    for mask, engine, bits in (
        (~exacting, "taylor", scenes.TRUTH_BITS),
        (exacting & found.certain.any(axis=0), "scipy", scenes.INTEGER_BITS),
    ):
        if mask.any():
            chosen = [phase for phase, here in zip(phases, mask, strict=True) if here]
            true = scenes.route_crossings(problem, chosen, jobs, bits, engine)
            times, beside = found.crossing_time[:, mask], found.separatrix[:, mask]
            part = true._replace(time=times, separatrix=beside)
            errors[:, mask] = scenes.phase_errors(part, true, phase_rate(problem))[1:]
    return errors


def start_trial(body: Body, place: Place, jobs: int, columns: int, n_crossings: int) -> Trial:
    """Trial of a start: errors of doubles, against the same start in 113 bits, are as predicted."""

    def measure() -> Findings:
        scene = Scene(body, place.J1 + place.J2mJ1, jobs)
        phases = [exact(x) for x in PHASES[:columns]]
        states = np.stack([place.state(body, float(x)) for x in phases], axis=1)
        # From a distance of 1e-300 an orbit takes some 700/u to leave: ln(1e300) = 691.
        errors, predicted, floor = compared(scene, states, n_crossings, 2000 / scene.u)
        return [np.max(errors / (predicted + floor))], {}

    claim = Claim(
        place.name,
        DEVIATIONS,
        "largest phase error of a crossing over its predicted root mean square",
        "a sum of independent roundings, carried by the variational equations, stays within"
        " ten standard deviations; an error of method would not",
    )
    return Trial("separatrices", place.name, (claim,), measure)
