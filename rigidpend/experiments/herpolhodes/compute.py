"""Experiment `herpolhodes`: the angular velocity in space along a route (Fig. 5)."""

import math
from collections.abc import Callable

import numpy as np

from rigidpend.experiments.contract import Means, Routes
from rigidpend.experiments.data import Data, Tree
from rigidpend.experiments.herpolhodes import CASE
from rigidpend.experiments.herpolhodes.schema import Config, HerpolhodeCase
from rigidpend.mechanics.in_space import plateaus
from rigidpend.routes.codes import RouteCodes, codes_of
from rigidpend.routes.herpolhode import RouteOrbit, follow, samples, separatrices, vertices
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import passage_rotations, rotation_period

ON_ROUTE = 1e-3
"""Share of the shortest passage by which an orbit on its route may cross late, at most."""
MOST_SAMPLES = 2_000_000
"""Largest number of samples of an orbit, of some 400 bytes each."""


def compute(config: Config, means: Means) -> Tree:
    """Compute the orbit of every case; its route must be certain, and the samples on it."""
    passages = config.problem.n_symbols + 1
    rotations = passage_rotations(config.problem.routes) * passages
    expected = rotations * config.numerics.points
    if MOST_SAMPLES < expected < math.inf:
        said = f"some {expected:.2g} samples, more than {MOST_SAMPLES:.2g}"
        turns = f"the body turns some {rotations:.2g} times in {passages} passages"
        raise ArithmeticError(f"{turns}: an orbit takes {said}")
    groups: dict[str, Tree] = {}
    for name, case in config.problem.cases.items():
        routes = _routes(config, case, means)
        orbit = _orbit(config, case, routes, means)
        groups[name] = _group(config, routes, orbit)
        error = np.abs(orbit.crossing_error).max()
        means.report(f"{name}: {groups[name]['route']}, crossing times within {error:.1e}")
    return groups


def _routes(config: Config, case: HerpolhodeCase, means: Means) -> RouteCodes:
    # In more bits than the samples, so that their distance at crossings is the samples' error.
    finer = tuple(bits for bits in means.arithmetic.precisions if bits > 53)
    arithmetic = means.arithmetic._replace(precisions=finer or means.arithmetic.precisions)
    found = codes_of(config.problem.routes, [case.theta2_0], arithmetic, means.jobs)
    if not found.certain.all():
        raise ArithmeticError(f"theta2_0 = {case.theta2_0}: the route is not certain")
    if not found.separatrix.all():
        said = "the orbit stays beside a pendulum motion and has no route of so many symbols"
        raise ArithmeticError(f"theta2_0 = {case.theta2_0}: {said}")
    return found


def _orbit(config: Config, case: HerpolhodeCase, routes: RouteCodes, means: Means) -> RouteOrbit:
    checked, theta2_0 = config.problem.routes, float(Phases([case.theta2_0]).near[0])
    orbit = follow(
        checked,
        theta2_0,
        routes.crossing_time[:, 0],
        step=rotation_period(checked) / config.numerics.points,
        engine=means.arithmetic.engine,
        tolerance=means.arithmetic.tolerance,
    )
    # The route may have been decided in more bits; samples in doubles might follow another one.
    shortest, late = np.diff(routes.crossing_time[:, 0]).min(), np.abs(orbit.crossing_error).max()
    said = ""
    if not late < ON_ROUTE * shortest:
        fewer = "fewer symbols" if len(routes.codes) > 1 else "a larger J1_0"
        said = f"the orbit in doubles leaves the route; take {fewer}"
    elif not np.array_equal(separatrices(orbit.states), routes.separatrix[:, 0]):
        said = "the samples miss a crossing of the route; take more points"
    if said:
        raise ArithmeticError(f"theta2_0 = {theta2_0}: {said}")
    return orbit


def _group(config: Config, routes: RouteCodes, orbit: RouteOrbit) -> Tree:
    problem, separatrix = config.problem, routes.separatrix[:, 0]
    sampled, angles = samples(problem.body, orbit.t, orbit.states), problem.body.angles(113)
    actions = float(problem.J1_0), float(problem.routes.J2mJ1_0(53))
    # The first sample, and the sample closest to the vertex after `n_wound` separatrices.
    crossings = routes.crossing_time[problem.n_wound - 1 : problem.n_wound + 1, 0]
    before, after = np.searchsorted(orbit.t, crossings)
    closest = before + np.argmax(np.abs(sampled.J1_over_J2[before:after] - 0.5))
    return {
        **sampled._asdict(),
        **{key: getattr(routes, key)[..., 0] for key in CASE if key in routes._fields},
        "crossing_error": orbit.crossing_error,
        "route": vertices(separatrix),
        "plateaus": plateaus(separatrix, angles, float(problem.h0), *actions),
        "wound": np.array([0, closest]),
    }


def orbits(config: Config, stored: Callable[[], Data]) -> Routes:
    """The orbit of each case."""
    problem = config.problem
    return {name: (problem.routes, [case.theta2_0]) for name, case in problem.cases.items()}
