"""Bodies, energies and starts at the ends of their ranges, against higher precision.

Two claims each: the largest phase error of a certain symbol, and the share of symbols that are
left uncertain. The first is the promise of the package, the second its reach.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.stress.trials import truth
from rigidpend.experiments.stress.trials.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.trials.starts import PHASES
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate import Crossings
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.problem import RouteProblem, phase_rate

ERROR = 1e-2
"""Radians: a symbol turns over at about one, so a hundredth leaves room for the worst orbit."""


class Extreme(NamedTuple):
    """A route problem at the end of a range; by default the body of Fig. 4 elsewhere."""

    name: str
    A: tuple[str, ...] = ("2", "1", "3/2")
    r: tuple[str, ...] = ("1", "1", "0")
    mu: str = "1/1000"
    h0: str = "1.3342"
    J1_0: str = "1e-8"
    most: int = 15
    """Symbols at most: fewer where a passage takes many rotations. Then two orbits at most."""
    long: bool = False
    """True if the truth about it takes minutes."""


NEAR_SPHERE = ("1.01", "0.99", "1")
"""Moments two per cent apart: nu is 157, and the separatrices split by exp(-157)."""
BODIES = (
    Extreme("A3 = A2 + 0.05", A=("1.5", "1", "1.05"), most=8),
    Extreme("A3 = A2 + 0.01", A=("1.5", "1", "1.01"), most=4),
    Extreme("A3 = A2 + 0.001", A=("1.5", "1", "1.001"), most=2),
    Extreme("A3 = A1 - 0.1", A=("2", "1", "1.9"), most=8),
    Extreme("A3 = A1 - 0.01", A=("2", "1", "1.99"), most=4),
    Extreme("A3 = A1 - 0.001", A=("2", "1", "1.999"), most=2),
    Extreme("flat", A=("2", "1/2", "3/2")),
    Extreme("near-spherical, 2 %", A=NEAR_SPHERE, most=2),
    Extreme(
        "near-spherical, J1_0 = 1e-80",
        ("1.02", "0.98", "1"),
        J1_0="1e-80",
        most=1,
        # Splitting and J1_0 are both below the rounding of 113 bits: 160 decide, and a passage
        # takes hundreds of rotations.
        long=True,
    ),
    Extreme("beta0 = 0", r=("1", "0", "0")),
    Extreme("beta0 = pi", r=("0", "1", "0")),
    Extreme("Hess", r=("1", "sqrt(2)", "0")),
    Extreme("Grioli", r=("1", "1", "0")),
)
"""Bodies with two moments nearly equal, flat or nearly a sphere, and special beta0."""
ENERGIES = (
    Extreme("mu = 1e-60 h0", mu="1.3342e-60", most=2),
    Extreme("mu = 1e-90 h0", mu="1.3342e-90", most=2),
    *(
        Extreme(f"mu = {share} h0", mu=f"1.3342*{share}")
        for share in ("0", "1e-30", "1e-8", "1e-2", "0.1", "0.3", "0.6", "0.9")
    ),
    *(
        Extreme(f"h0 = mu (1 + {above})", mu="1.3342", h0=f"1.3342*(1 + {above})")
        for above in ("1e-3", "1e-6", "1e-12")
    ),
)
"""Weights from none to nearly h0, where the pendulum nearly stops at the top."""
LOWER = tuple(
    Extreme(f"J1_0 = {J1}", J1_0=J1)
    for J1 in ("1e-2", "1e-4", "1e-6", "1e-12", "1e-16", "1e-32", "1e-64", "1e-100", "1e-300")
)
"""Starts ever closer to the lower periodic orbit."""
UPPER = tuple(
    Extreme(f"J2_0 - J1_0 = {J}", J1_0=f"sqrt(2*1.3342*3/4) - {J}")
    for J in ("1e-2", "1e-4", "1e-8", "1e-16", "1e-20", "1e-24", "1e-32", "1e-100", "1e-300")
)
"""Starts ever closer to the upper one, where J2_0 - J1_0 is small."""


def trial(extreme: Extreme, *, columns: int, n_symbols: int, engine: str, jobs: int) -> Trial:
    """Both claims of a route problem, and their measurement.

    Parameters
    ----------
    extreme : Extreme
    columns, n_symbols : int
        How many orbits, how many symbols on each.
    engine : str
    jobs : int
    """
    error, uncertain = claims = _claims(extreme)
    n = min(n_symbols, extreme.most)
    phases = PHASES[: columns if extreme.most > 2 else min(columns, 2)]

    def measure() -> Findings:
        body, h0, J1 = (
            Body(extreme.A, extreme.r, extreme.mu),
            exact(extreme.h0),
            exact(extreme.J1_0),
        )
        problem = RouteProblem(body, h0, J1, n)
        routes = route_codes(body, phases, h0=h0, J1_0=J1, n_symbols=n, engine=engine, jobs=jobs)
        wrong = _errors(problem, routes, phases, engine, jobs)
        # An uncertain symbol promises nothing, so that it may be wrong.
        worst = float(np.max(wrong, where=routes.certain, initial=0.0))
        left = float(1 - routes.certain.mean())
        return Findings({error.name: worst, uncertain.name: left})

    return Trial(extreme.name, claims, measure)


def _claims(extreme: Extreme) -> tuple[Claim, Claim]:
    return (
        Claim(
            f"{extreme.name}: error",
            "largest phase error at a certain symbol, against"
            f" {truth.BITS} or {truth.INTEGER_BITS} bits",
            "rad",
            ERROR,
            "a symbol turns over at about a radian; a hundredth is far from it",
        ),
        Claim(
            f"{extreme.name}: uncertain",
            "share of symbols that stay uncertain after the last precision",
            "1",
            0.0,
            "160 bits outlast 15 passages, each of which triples an error",
        ),
    )


def _errors(
    problem: RouteProblem, routes: RouteCodes, phases: tuple[str, ...], engine: str, jobs: int
) -> NDArray[np.float64]:
    """The phase error of each symbol, infinite for a wrong one, (n_symbols, n)."""
    outcome = np.zeros(len(phases), dtype=np.uint8)
    found = Crossings(routes.crossing_time, routes.separatrix, outcome)
    errors = np.zeros(routes.codes.shape)
    # What took 113 bits or more is held against integers of more bits.
    for columns, arithmetic, bits in (
        (np.flatnonzero(routes.bits < truth.BITS), engine, truth.BITS),
        (np.flatnonzero((routes.bits >= truth.BITS) & routes.certain.any(axis=0)), "scipy", 0),
    ):
        if columns.size:
            true = truth.route_crossings(
                problem,
                [phases[k] for k in columns],
                engine=arithmetic,
                bits=bits or truth.INTEGER_BITS,
                jobs=jobs,
            )
            part = Crossings(found.time[:, columns], found.separatrix[:, columns], outcome)
            errors[:, columns] = truth.phase_errors(part, true, phase_rate(problem))[1:]
    return errors
