"""Experiment `herpolhodes`: the angular velocity in space along a route (Fig. 5)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.config.description import (
    Row,
    body_rows,
    exact_row,
    number_row,
)
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import compare
from rigidpend.experiments.data.compare import Difference
from rigidpend.experiments.data.layout import datasets
from rigidpend.experiments.data.tree import Data, Tree
from rigidpend.experiments.herpolhodes.layout import OF_ROUTE, SAMPLED
from rigidpend.experiments.route_arrays import crossing_tolerance
from rigidpend.mechanics.precession import increments, plateaus
from rigidpend.numbers.doubles import Array
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.herpolhode import (
    RouteOrbit,
    follow,
    samples,
    separatrices,
    vertices,
)
from rigidpend.routes.problem import rotation_period

if TYPE_CHECKING:
    from rigidpend.experiments.contract import Routes
    from rigidpend.experiments.herpolhodes.schema import Config, HerpolhodeCase

GROWTH = 10.0
"""Allowed growth of the distance of two orbits from one crossing to the next.

Between builds and engines they were, in t', up to 6e-15 and 4e-10 apart at the first two
crossings and 1e-6 at the sixth."""


def compute(config: Config, means: Means) -> Tree:
    """Compute the orbit of every case of a config.

    Returns
    -------
    Tree
        A group for each case: `SAMPLED` and `OF_ROUTE`.

    Raises
    ------
    ArithmeticError
        A route is not certain, or the orbit in doubles left it.
    """
    groups: dict[str, Tree] = {}
    for name, case in config.problem.cases.items():
        routes = _routes(config, case, means)
        orbit = _orbit(config, routes, means)
        groups[name] = _group(config, routes, orbit)
        error = np.abs(orbit.crossing_error).max()
        passed = vertices(routes.separatrix[:, 0])
        means.report(f"{name}: {passed}, crossing times within {error:.1e}")
    return groups


def _routes(config: Config, case: HerpolhodeCase, means: Means) -> RouteCodes:
    problem = config.problem
    found = route_codes(
        problem.body,
        [case.theta2_0],
        h0=problem.h0,
        J1_0=problem.J1_0,
        n_symbols=problem.n_symbols,
        jobs=means.jobs,
        **means.arithmetic._asdict(),
    )
    if not found.certain.all() or not found.separatrix.all():
        raise ArithmeticError(f"theta2_0 = {case.theta2_0}: the route is not certain")
    return found


def _orbit(config: Config, routes: RouteCodes, means: Means) -> RouteOrbit:
    checked, theta2_0 = config.problem.routes, float(routes.theta2_0[0])
    orbit = follow(
        checked,
        theta2_0,
        routes.crossing_time[:, 0],
        step=rotation_period(checked) / config.numerics.points,
        engine=means.arithmetic.engine,
        tolerance=means.arithmetic.tolerance,
    )
    # The route may have been decided in more bits: samples in doubles must not tell another one.
    if not np.array_equal(separatrices(orbit.states), routes.separatrix[:, 0]):
        raise ArithmeticError(f"theta2_0 = {theta2_0}: the orbit in doubles leaves the route")
    return orbit


def _group(config: Config, routes: RouteCodes, orbit: RouteOrbit) -> Tree:
    problem, separatrix = config.problem, routes.separatrix[:, 0]
    sampled = samples(problem.body, orbit)
    of_route = {
        **{key: getattr(routes, key)[..., 0] for key in OF_ROUTE if key in routes._fields},
        "crossing_error": orbit.crossing_error,
        "route": vertices(separatrix),
        "plateaus": plateaus(separatrix, problem.body.angles(), float(problem.h0)),
        "wound": _wound(problem.n_wound, routes, sampled["J1_over_J2"], orbit.t),
    }
    return {
        **datasets(SAMPLED, sampled),
        **datasets(OF_ROUTE, of_route),
    }


def _wound(count: int, routes: RouteCodes, height: Array, t: Array) -> NDArray[np.int64]:
    """Find the first sample, and the one closest to the vertex behind `count` separatrices."""
    before, after = np.searchsorted(t, routes.crossing_time[count - 1 : count + 1, 0])
    return np.array([0, before + np.argmax(np.abs(height[before:after] - 0.5))])


def orbits(config: Config, stored: Callable[[], Data]) -> Routes:
    """The orbit of each case."""
    problem = config.problem
    return {name: (problem.routes, [case.theta2_0]) for name, case in problem.cases.items()}


def describe(config: Config) -> list[Row]:
    """Describe a config in rows, with what follows from it, units named."""
    problem = config.problem
    gained = increments(problem.body.angles(), float(problem.h0))
    return [
        *body_rows(problem.body),
        exact_row("h0", "energy constant, kappa J2_0^2/2", problem.h0),
        exact_row("J1_0", "initial action, dimensionless", problem.J1_0),
        number_row("J2_0", "initial |M|, dimensionless", float(problem.routes.J2_0(53))),
        exact_row("n_symbols", "turns from a separatrix to the next", problem.n_symbols),
        *(
            Row(name, f"theta2_0 = {case.theta2_0}", "rad, initial phase")
            for name, case in problem.cases.items()
        ),
        *(
            Row(f"increment {i}", f"{x:+.6f}", f"rad, of theta3 along separatrix {i}, to O(mu)")
            for i, x in enumerate(gained, 1)
        ),
    ]


def differences(stored: Data, fresh: Data) -> list[Difference]:
    """Find where two results of a config disagree by more than their arithmetic explains.

    Routes must be the same. Samples may differ by what they change in the time by which two
    orbits may be apart: little at first, and more behind each passage.
    """
    return compare.members(stored, fresh, _case_differences)


def _case_differences(stored: Data, fresh: Data) -> list[Difference]:
    if found := compare.keys(stored, fresh):
        return found
    for key in stored:
        if np.shape(stored[key]) != np.shape(fresh[key]):
            return compare.arrays(key, stored[key], fresh[key])
    for key, allowed in _allowed(stored).items():
        old, new = np.asarray(stored[key]), np.asarray(fresh[key])
        # theta1 is modulo 4 pi, and at its cut rounding decides the side.
        if key == "theta1":
            new = old + np.remainder(new - old + 2 * np.pi, 4 * np.pi) - 2 * np.pi
        found += compare.arrays(key, old, new, allowed)
    return found


def _allowed(stored: Data) -> dict[str, Any]:
    """Allowed difference of each field; `bits` hangs on the last bit and is not compared."""
    t, crossings = stored["t"], stored["crossing_time"]
    apart = crossing_tolerance(crossings.size + 1, GROWTH)[:, 0]
    # A sample may be as far off as the next crossing; the last ones, too, have a next one.
    of_sample, of_crossing = apart[np.searchsorted(crossings, t)], apart[:-1]
    exactly = dict.fromkeys(("route", "codes", "separatrix", "certain", "wound"), 0.0)
    rounding = {
        key: compare.ROUNDING * max(1.0, float(np.abs(stored[key]).max()))
        for key in ("theta2_0", "plateaus", "t")
    }
    # In the time by which orbits are apart a field changes by its largest slope at most.
    moving = {
        key: 1e-12 + of_sample * float(np.abs(np.diff(stored[key], axis=0)).max() / t[1])
        for key in ("theta3", "alpha", "theta1", "J1_over_J2")
    }
    speed = float(np.abs(np.diff(stored["omega"], axis=0)).max() / t[1])
    moving["omega"] = (1e-12 + of_sample * speed)[:, None]
    of_route = dict.fromkeys(("crossing_time", "crossing_error"), of_crossing)
    return {**exactly, **rounding, **of_route, **moving}
