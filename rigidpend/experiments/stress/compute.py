"""Experiment `stress`: trials at the limits, each with a stated bound."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data.tree import Tree
from rigidpend.experiments.lie_poisson import SCHEMES
from rigidpend.experiments.stress.trials import (
    addresses,
    extremes,
    honesty,
    long_time,
    passages,
    spoilt_maps,
    symmetries,
)
from rigidpend.experiments.stress.trials.claims import Trial, tried
from rigidpend.experiments.stress.trials.scenes import Scene, Way
from rigidpend.machine.progress import PartDone
from rigidpend.orbits.integrate import DEFAULT_TOLERANCE, FINEST_TOLERANCE

if TYPE_CHECKING:
    from rigidpend.experiments.stress.schema import Config, Problem

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
    every = list(trials(config.problem, means))
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for number, (kind, trial) in enumerate(every, 1):
        name, begun = label(trial.name), time.perf_counter()
        made: Any = means.part(f"{kind}.{name}", partial(tried, trial))
        group = found.setdefault(kind, {"claims": {}, "curves": {}})
        group["claims"] |= made["claims"]
        # A trial that refuses to compute has none, and an empty group would not fit the layout.
        if made["curves"]:
            group["curves"][name] = made["curves"]
        verdicts = ", ".join(str(claim["verdict"].values) for claim in made["claims"].values())
        taken = f"{time.perf_counter() - begun:.1f} s"
        text = f"{number}/{len(every)}: {kind}, {trial.name}: {verdicts}, {taken}"
        means.report(PartDone(text, number, len(every)))
    return found


def trials(problem: Problem, means: Means) -> Iterator[tuple[str, Trial]]:
    """All trials, each with its group, in the order in which they are run."""
    way, body = Way(means.arithmetic.engine, means.jobs), problem.body
    scene = Scene(body, math.sqrt(2 * float(problem.h0) / body.kappa))
    yield "symmetries", symmetries.trial(scene, 4, way)
    asked = problem.extremes
    for group, members in extremes.GROUPS.items():
        for extreme in members:
            if asked.long or not extreme.long:
                sizes = {"columns": asked.columns, "n_symbols": asked.n_symbols}
                yield group, extremes.trial(extreme, way, **sizes)
    for place in extremes.PLACES:
        sizes = {"columns": asked.columns, "n_crossings": 5}
        yield "separatrices", extremes.start_trial(body, place, way, **sizes)
    yield from (("passages", trial) for trial in _passages(scene, problem, way))
    yield from (("honesty", trial) for trial in honesty_trials(problem, way))
    # In integers, as without that engine, an orbit of many digits takes minutes.
    if way.engine == "taylor":
        yield from (("addresses", trial) for trial in _addresses(problem))
    yield from (("long_time", trial) for trial in _long_time(scene, problem, way))


def _passages(scene: Scene, problem: Problem, way: Way) -> Iterator[Trial]:
    asked = problem.passages
    fan = passages.Fan(scene, float(problem.J1_0), problem.seed)
    yield passages.growth_trial(fan, way, orbits=asked.orbits, n_crossings=asked.n_crossings)
    for text, columns in asked.columns.items():
        bits = int(text)
        yield passages.decided_trial(
            fan,
            way,
            bits,
            h0=problem.h0,
            columns=columns,
            checked=asked.checked.get(text, 0),
            n_symbols=round(SYMBOLS_PER_BIT * bits),
            tangents=asked.orbits,
        )


def honesty_trials(problem: Problem, way: Way) -> Iterator[Trial]:
    """Trials of the flags `certain`: a hard orbit, spoilt tolerances and spoilt maps."""
    asked, thirds, body = problem.honesty, len(honesty.STARTS), problem.body
    common = {"n_symbols": asked.n_symbols, "seed": problem.seed}
    yield honesty.hard_trial(way.engine)
    for k, J1_0 in enumerate(honesty.STARTS):
        # What the division leaves goes to the first starts, so that no orbit is lost.
        sizes = {
            "orbits": asked.orbits // thirds + (k < asked.orbits % thirds),
            "checked": asked.checked // thirds + (k < asked.checked % thirds),
        }
        tolerances = list(map(str, asked.tolerances))
        yield honesty.trial(body, problem.h0, J1_0, tolerances, way, **sizes, **common)
    # Maps are held against the kernel's orbits, in 64 bits too, which the other engine lacks.
    if way.engine == "taylor":
        J1_0, orbits = str(problem.J1_0), asked.orbits // thirds
        yield spoilt_maps.trial(body, problem.h0, J1_0, way.jobs, orbits=orbits, **common)


def _addresses(problem: Problem) -> Iterator[Trial]:
    asked, seed = problem.addresses, problem.seed
    setups = {"own body": addresses.Setup(problem.body, problem.h0, problem.J1_0)}
    setups |= {f"body {k + 1}": addresses.drawn(1000 * seed + k) for k in range(asked.bodies)}
    sizes = {"words": asked.words, "n_symbols": asked.n_symbols}
    for k, (name, setup) in enumerate(setups.items()):
        yield addresses.trial(name, setup, **sizes, seed=seed + k)


def _long_time(scene: Scene, problem: Problem, way: Way) -> Iterator[Trial]:
    asked, compiled = problem.long_time, way.engine == "taylor"
    turns = (asked.rotations if compiled else asked.rotations_scipy) // 3
    yield long_time.pendulum_trial(problem.body, problem.h0, way.engine, rotations=turns)
    setting = long_time.Setting(scene, problem.seed)
    ways = [(way._replace(engine="scipy"), DEFAULT_TOLERANCE, asked.rotations_scipy, 4)]
    if compiled:
        for tolerance in (FINEST_TOLERANCE, DEFAULT_TOLERANCE):
            ways.append((way, tolerance, asked.rotations, asked.orbits))
    for each, tolerance, rotations, orbits in ways:
        sizes = {"rotations": rotations, "orbits": orbits}
        yield long_time.engine_trial(setting, each, tolerance[each.engine], **sizes)
    sizes = {"rotations": asked.rotations_splitting, "orbits": asked.orbits}
    for order in SCHEMES:
        yield long_time.splitting_trial(setting, order=order, **sizes)


def label(name: str) -> str:
    """A name of letters, digits, points and dashes."""
    # Labels name groups in a file and parts on the disk, which bear no blank, slash or bracket.
    return re.sub(r"[^A-Za-z0-9.-]+", "_", name).strip("_")
