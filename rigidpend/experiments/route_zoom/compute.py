"""Experiment `route_zoom`: successive zooms into the arrays of Fig. 4.

At a change of symbol i the orbit ends on a periodic orbit: it is doubly asymptotic. Orbits at a
distance d from it stay there for a time ln(1/d)/lambda longer before they leave, and their further
course depends on the phase at that moment. So a zoom by exp(pi^2/nu), which adds one rotation,
shows the same rows above i again, at any depth.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise, product

import numpy as np

from rigidpend.config.description import Row
from rigidpend.experiments.contract import Means, Routes
from rigidpend.experiments.data import Data, Tree
from rigidpend.experiments.route_zoom.schema import Config, Problem
from rigidpend.machine.progress import PartDone
from rigidpend.numbers.exact import Exact, exact
from rigidpend.orbits.integrate.reference_orbit import reference_bits
from rigidpend.routes.costs import integration, share_open
from rigidpend.routes.neighbourhood import (
    FIXED,
    Bracket,
    Neighbourhood,
    NoChange,
    check_change,
    narrowed,
)
from rigidpend.routes.phases import Grid
from rigidpend.routes.problem import passage_rotations

FINER = 2.0**-20
"""Width of a level's bracket as a share of its step; so narrow that levels can be compared."""
BEGIN, AT_LEAST, COLUMNS = 0.3, 1.2e-3, 25
"""Seconds of any run, and of a symbol of a level; and the number of columns that doubles these.

A symbol takes those seconds for each rotation of a passage, and once more.
Measured on one core with five bodies, of 1.4 to 7.5 rotations a passage."""
DEEP, ALONE = 7e-4, 1.8e-5
"""Seconds of the search and of the reference orbits, and of a symbol of an orbit in many bits.

They too are taken for each rotation, and once more, and grow with the square of a step's digits:
measured at 30 to 120 digits, with four bodies."""
LONE = 3.0
"""Time of an orbit that is integrated alone in up to `FIXED` bits, over that of one among many.

It does not fill a vector. With three bodies, of whose orbits 30 to 40 % were, it was 2.5 to 3.7."""


def compute(config: Config, means: Means) -> Tree:
    """Compute every level of a config; phases are exact texts, as doubles are too coarse."""
    problem, steps = config.problem, _steps(config.problem)
    finest = float(steps[-1])
    found = means.part("centres", partial(_centres, problem, steps, means))
    brackets = [Bracket(*map(exact, each.values())) for each in found.values()]
    # One reference orbit serves all levels: the one closest to the change, near all columns.
    centre = brackets[-1].between(1, 2)
    around = Neighbourhood(problem.routes, centre, finest, means.arithmetic, means.jobs)
    groups: dict[str, Tree] = {}
    levels = zip(_names(problem), brackets, steps, strict=True)
    for level, (name, bracket, step) in enumerate(levels, 1):
        groups[name] = means.part(name, partial(_level, around, problem, bracket, step))
        bits = " and ".join(map(str, np.unique(groups[name]["bits"])))
        done = level, problem.levels
        means.report(
            PartDone("{}/{}: ".format(*done) + f"step {float(step):.0e}, {bits} bits", *done)
        )
    return {
        "levels": groups,
        "repeats_after": math.exp(math.pi**2 / problem.body.nu),
        "symbol": problem.symbol,
        "reference_bits": around.bits,
    }


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes on two cores."""
    problem = config.problem
    rotations = passage_rotations(problem.routes)
    symbols, steps = problem.levels * (problem.n_symbols + 1), [*map(float, _steps(problem))]
    columns = AT_LEAST * symbols * (1 + problem.count / COLUMNS)
    seconds = BEGIN + (1 + rotations) * (columns + DEEP * math.log10(steps[-1]) ** 2)
    # The share of a level's orbits that is integrated alone, beyond `FIXED` in a falling precision.
    for step, (before, bits) in product(steps, pairwise(config.numerics.precisions)):
        alone = (problem.count + 2) * share_open(problem.routes, before)
        if (needed := reference_bits(step, bits)) > FIXED:
            each = (1 + rotations) * ALONE * problem.n_symbols * math.log10(step) ** 2
        else:
            each = LONE * integration(problem.routes, (needed,))
        seconds += alone * each
    return seconds


def _names(problem: Problem) -> list[str]:
    """The names of the levels in a result."""
    return [f"level{level:02d}" for level in range(problem.levels)]


def _steps(problem: Problem) -> list[Exact]:
    """The spacing of each level's columns, radians."""
    return [problem.step / problem.factor**level for level in range(problem.levels)]


def _centres(problem: Problem, steps: Sequence[Exact], means: Means) -> Tree:
    """Find the brackets of all levels, as exact texts."""
    # The search needs no symbols after the one that changes.
    short = dataclasses.replace(problem.routes, n_symbols=problem.symbol)
    path = narrowed(
        short,
        Bracket(*problem.between),
        float(steps[-1]) * FINER,
        means.arithmetic,
        lambda width: means.report(f"the change is known to {width:.0e} rad"),
    )
    # For each level the first bracket that is narrow enough.
    chosen = [next(b for b in path if b.width <= float(step) * FINER) for step in steps]
    return {
        f"bracket{k:02d}": {name: end.text for name, end in b._asdict().items()}
        for k, b in enumerate(chosen)
    }


def _level(around: Neighbourhood, problem: Problem, bracket: Bracket, step: Exact) -> Tree:
    """Compute an array around the middle of a bracket, at whose ends the symbol differs."""
    centre = bracket.between(1, 2)
    phases = _phases(centre, problem, step)
    # The bracket's ends are computed too: they show that the symbol changes between them.
    routes = around.routes([*bracket, *phases])
    ends = slice(problem.symbol), slice(2)
    if not routes.certain[ends].all():
        raise NoChange(f"symbol {problem.symbol} is not certain beside {centre}: add a precision")
    left, right = (list(map(int, column)) for column in routes.codes[ends].T)
    check_change(left, right, bracket)
    return {
        **{name: array[..., 2:] for name, array in routes._asdict().items()},
        # The text is exact: read again it gives the number that was used.
        "centre": centre.text,
        "theta2_0": [phase.text for phase in phases],
        "offset": np.array([float(phase - centre) for phase in phases]),
        "step": float(step),
    }


def _phases(centre: Exact, problem: Problem, step: Exact) -> list[Exact]:
    """The columns' phases around a centre; rational phases are written as quotients."""
    grid = Grid(centre - step * (problem.count - 1) / 2, step, problem.count)
    return [phase.shortest for phase in grid]


def orbits(config: Config, stored: Callable[[], Data]) -> Routes:
    """The orbits of each level, around the centre that a computation has found."""
    problem, levels = config.problem, stored()["levels"]
    return {
        name: (problem.routes, _phases(exact(levels[name]["centre"]), problem, step))
        for name, step in zip(_names(problem), _steps(problem), strict=True)
    }


def describe(config: Config) -> list[Row]:
    """Row with the spacing of columns, from the first level to the last."""
    steps = _steps(config.problem)
    first, last = float(steps[0]), float(steps[-1])
    return [Row("steps", f"{first:.3g} to {last:.3g}", "rad, spacing of columns")]
