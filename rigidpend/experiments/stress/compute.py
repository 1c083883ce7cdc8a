"""Experiment `stress`: trials at the limits, each with a stated bound."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

from rigidpend.config.description import Row, body_rows, exact_row
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data.tree import Tree
from rigidpend.experiments.stress.trials import (
    addresses,
    extremes,
    honesty,
    long_time,
    passages,
    pendulum,
    spoilt_maps,
    starts,
    symmetries,
)
from rigidpend.experiments.stress.trials.claims import Trial, tried
from rigidpend.machine.progress import PartDone
from rigidpend.mechanics.body import Body
from rigidpend.orbits.integrate import DEFAULT_TOLERANCE, FINEST_TOLERANCE
from rigidpend.orbits.integrate.lie_poisson import SCHEMES

if TYPE_CHECKING:
    from rigidpend.experiments.stress.schema import Config, Problem


GROUPS = {
    "bodies": extremes.BODIES,
    "energies": extremes.ENERGIES,
    "lower_starts": extremes.LOWER,
    "upper_starts": extremes.UPPER,
}
"""Route problems at the ends of their ranges, by kind."""
SYMBOLS_PER_BIT = 1.5
"""Number of symbols that are asked for per bit, so that no precision decides all."""


def compute(config: Config, means: Means) -> Tree:
    """Run all trials of a config; what an interrupted run finished is not run again.

    Returns
    -------
    Tree
        A group for each kind of trial: `claims`, each with value, bound, ratio and verdict, and
        the `curves` behind them.
    """
    trials = list(_trials(config.problem, means))
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for number, (kind, trial) in enumerate(trials, 1):
        label, begun = _label(trial.name), time.perf_counter()
        made: Any = means.part(f"{kind}.{label}", partial(tried, trial))
        group = found.setdefault(kind, {"claims": {}, "curves": {}})
        group["claims"] |= made["claims"]
        # A trial that refuses to compute has none, and an empty group would not fit the layout.
        if made["curves"]:
            group["curves"][label] = made["curves"]
        verdicts = ", ".join(str(claim["verdict"].values) for claim in made["claims"].values())
        taken = f"{time.perf_counter() - begun:.1f} s"
        text = f"{number}/{len(trials)}: {kind}, {trial.name}: {verdicts}, {taken}"
        means.report(PartDone(text, number, len(trials)))
    return found


def _trials(problem: Problem, means: Means) -> Iterator[tuple[str, Trial]]:
    """All trials, each with its group, in the order in which they are run."""
    body, engine, jobs = problem.body, means.arithmetic.engine, means.jobs
    J2 = math.sqrt(2 * float(problem.h0) / body.kappa)
    yield "symmetries", symmetries.trial(body, J2, 4, engine, jobs)
    yield from _extremes(body, problem.extremes, engine, jobs)
    yield from _passages(body, J2, problem, engine, jobs)
    yield from _honesty(body, problem, engine, jobs)
    # In integers, as without that engine, an orbit of many digits takes minutes.
    if engine == "taylor":
        yield from _addresses(problem)
    yield from _long_time(body, J2, problem, engine, jobs)


def _extremes(body: Body, asked: Any, engine: str, jobs: int) -> Iterator[tuple[str, Trial]]:
    common = {"columns": asked.columns, "engine": engine, "jobs": jobs}
    for group, members in GROUPS.items():
        for extreme in members:
            if extreme.long and not asked.long:
                continue
            yield group, extremes.trial(extreme, n_symbols=asked.n_symbols, **common)
    for place in starts.PLACES:
        yield "separatrices", starts.trial(body, place, n_crossings=5, **common)


def _passages(
    body: Body, J2: float, problem: Problem, engine: str, jobs: int
) -> Iterator[tuple[str, Trial]]:
    asked = problem.passages
    fan = passages.Fan(body, float(problem.J1_0), J2, problem.seed)
    yield (
        "passages",
        passages.growth_trial(
            fan, orbits=asked.orbits, n_crossings=asked.n_crossings, engine=engine, jobs=jobs
        ),
    )
    for text, columns in asked.columns.items():
        bits = int(text)
        trial = passages.decided_trial(
            fan,
            bits,
            h0=problem.h0,
            columns=columns,
            checked=asked.checked.get(text, 0),
            n_symbols=round(SYMBOLS_PER_BIT * bits),
            tangents=asked.orbits,
            engine=engine,
            jobs=jobs,
        )
        yield "passages", trial


def _honesty(body: Body, problem: Problem, engine: str, jobs: int) -> Iterator[tuple[str, Trial]]:
    asked, thirds = problem.honesty, len(honesty.STARTS)
    yield "honesty", honesty.hard_trial(engine)
    for k, J1_0 in enumerate(honesty.STARTS):
        trial = honesty.trial(
            body,
            problem.h0,
            J1_0,
            list(map(str, asked.tolerances)),
            # What the division leaves goes to the first starts, so that no orbit is lost.
            orbits=asked.orbits // thirds + (k < asked.orbits % thirds),
            checked=asked.checked // thirds + (k < asked.checked % thirds),
            n_symbols=asked.n_symbols,
            seed=problem.seed,
            engine=engine,
            jobs=jobs,
        )
        yield "honesty", trial
    # Maps are held against the kernel's orbits, in 64 bits too, which the other engine lacks.
    if engine == "taylor":
        yield (
            "honesty",
            spoilt_maps.trial(
                body,
                problem.h0,
                str(problem.J1_0),
                orbits=asked.orbits // thirds,
                n_symbols=asked.n_symbols,
                seed=problem.seed,
                jobs=jobs,
            ),
        )


def _addresses(problem: Problem) -> Iterator[tuple[str, Trial]]:
    asked, seed = problem.addresses, problem.seed
    setups = {"own body": addresses.Setup(problem.body, problem.h0, problem.J1_0)}
    for k in range(asked.bodies):
        setups[f"body {k + 1}"] = addresses.drawn(1000 * seed + k)
    for k, (name, setup) in enumerate(setups.items()):
        yield (
            "addresses",
            addresses.trial(
                name, setup, words=asked.words, n_symbols=asked.n_symbols, seed=seed + k
            ),
        )


def _long_time(
    body: Body, J2: float, problem: Problem, engine: str, jobs: int
) -> Iterator[tuple[str, Trial]]:
    asked = problem.long_time
    turns = (asked.rotations if engine == "taylor" else asked.rotations_scipy) // 3
    yield "long_time", pendulum.trial(body, problem.h0, rotations=turns, engine=engine)
    setting = long_time.Setting(body, J2, problem.seed)
    ways = [("scipy", DEFAULT_TOLERANCE["scipy"], asked.rotations_scipy, 4)]
    if engine == "taylor":
        ways += [
            ("taylor", tolerance["taylor"], asked.rotations, asked.orbits)
            for tolerance in (FINEST_TOLERANCE, DEFAULT_TOLERANCE)
        ]
    for name, tolerance, rotations, orbits in ways:
        trial = long_time.engine_trial(
            setting,
            engine=name,
            tolerance=tolerance,
            rotations=rotations,
            orbits=orbits,
            jobs=jobs,
        )
        yield "long_time", trial
    for order in SCHEMES:
        rotations = asked.rotations_splitting
        yield (
            "long_time",
            long_time.splitting_trial(
                setting, order=order, rotations=rotations, orbits=asked.orbits
            ),
        )


def _label(name: str) -> str:
    """A name of letters, digits, points and dashes."""
    # Labels name groups in a file and parts on the disk, which bear no blank, slash or bracket.
    return re.sub(r"[^A-Za-z0-9.-]+", "_", name).strip("_")


def describe(config: Config) -> list[Row]:
    """Describe a config in rows, with what follows from it, units named."""
    problem = config.problem
    asked = problem.long_time
    tolerances = ", ".join(map(str, problem.honesty.tolerances))
    many = sum(map(len, GROUPS.values())) + len(starts.PLACES)
    return [
        *body_rows(problem.body),
        exact_row("h0", "energy constant, kappa J2_0^2/2", problem.h0),
        exact_row("J1_0", "initial action, dimensionless", problem.J1_0),
        Row("long time", f"{asked.rotations} rotations, {asked.orbits} orbits", "Taylor engine"),
        Row("extremes", f"{many} of {problem.extremes.columns} orbits", "bodies, energies, starts"),
        Row("passages", f"{problem.passages.orbits} orbits", "measured and predicted errors"),
        Row("honesty", f"{problem.honesty.orbits} orbits", f"at tolerances {tolerances}"),
        Row("checked", f"{problem.honesty.checked} of them", "in principal axes, 113 bits"),
        Row("addresses", f"{problem.addresses.bodies} random bodies", "orbits by their codes"),
    ]
