"""Experiment `herpolhodes`: the angular velocity in space along a route (Fig. 5)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend import integrate
from rigidpend.experiments import Means, Row
from rigidpend.experiments.route_codes import ROUNDING
from rigidpend.experiments.rows import body_rows
from rigidpend.herpolhode import Orbit, follow, samples, separatrices, vertices
from rigidpend.precession import increments, plateaus
from rigidpend.routes.certainty import LINEAR
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.problem import RouteProblem, rotation_period
from rigidpend.tree import Dataset, Tree

Array = NDArray[np.float64]

SAMPLED = {
    "t": ("t' = t s", "times of the samples, s = sqrt((A1 - A2)/(A1 A2))"),
    "theta1": ("rad", "0 .. 4 pi"),
    "J1_over_J2": ("1", "0 at the lower periodic orbit, 1 at the upper one"),
    "theta3": ("rad", "precession angle of M, by (th3)"),
    "alpha": ("rad", "angle of omega's horizontal part from eta, by (eqPV)"),
    "omega": ("1/t", "(n, 3): omega_xi, omega_eta, omega_zeta in physical units; xi is upward"),
}
OF_ROUTE = {
    "theta2_0": ("rad", "initial phase"),
    "codes": ("1", "symbols of the route: 0 left, 1 right, 255 none (no return)"),
    "certain": ("1", "whether two independent computations establish the symbol"),
    "bits": ("bit", "precision that decided the route"),
    "separatrix": ("1", "separatrices of the route, 1..4"),
    "crossing_time": ("t' = t s", "when the route crosses J1 = J2/2 beside each separatrix"),
    "crossing_error": ("t' = t s", "how much later the sampled orbit crosses than the route"),
    "route": ("text", "vertices of the heteroclinic cycle in their order"),
    "plateaus": ("rad", "theta3 near each periodic orbit, predicted by (tri1) to first order"),
    "wound": ("1", "first and last sample between the first vertex and that of n_wound"),
}
GROUP = (*SAMPLED, *OF_ROUTE)
"""What the group of a case holds."""
MARGIN = 20
"""Orbits of two engines may lie further apart than either from the route, by this factor."""


def compute(config: Any, means: Means) -> Tree:
    """Compute the orbit of every case of a config.

    Parameters
    ----------
    config : rigidpend.config.schema.herpolhodes.Config
    means : Means

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


def _routes(config: Any, case: Any, means: Means) -> RouteCodes:
    problem, numerics = config.problem, config.numerics
    found = route_codes(
        problem.body,
        [case.theta2_0],
        h0=problem.h0,
        J1_0=problem.J1_0,
        n_symbols=problem.n_symbols,
        engine=means.engine,
        tolerance=_tolerance(config, means),
        precisions=numerics.precisions,
        jobs=means.jobs,
    )
    if not found.certain.all() or not found.separatrix.all():
        raise ArithmeticError(f"theta2_0 = {case.theta2_0}: the route is not certain")
    return found


def _orbit(config: Any, routes: RouteCodes, means: Means) -> Orbit:
    checked, theta2_0 = _problem(config.problem), float(routes.theta2_0[0])
    orbit = follow(
        checked,
        theta2_0,
        routes.crossing_time[:, 0],
        step=rotation_period(checked) / config.numerics.points,
        engine=means.engine,
        tolerance=_tolerance(config, means),
    )
    if not np.array_equal(separatrices(orbit.states), routes.separatrix[:, 0]):
        raise ArithmeticError(f"theta2_0 = {theta2_0}: the orbit in doubles leaves the route")
    return orbit


def _group(config: Any, routes: RouteCodes, orbit: Orbit) -> Tree:
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
        **{key: Dataset(sampled[key], *meaning) for key, meaning in SAMPLED.items()},
        **{key: Dataset(of_route[key], *meaning) for key, meaning in OF_ROUTE.items()},
    }


def _wound(count: int, routes: RouteCodes, height: Array, t: Array) -> NDArray[np.int64]:
    """The first sample, and the one closest to the vertex behind `count` separatrices."""
    before, after = np.searchsorted(t, routes.crossing_time[count - 1 : count + 1, 0])
    return np.array([0, before + np.argmax(np.abs(height[before:after] - 0.5))])


def describe(config: Any) -> list[Row]:
    """What a config asks for, with what follows from it: for people, units named."""
    problem = config.problem
    gained = increments(problem.body.angles(), float(problem.h0))
    return [
        *body_rows(problem.body),
        Row("h0", str(problem.h0), "energy constant, kappa J2_0^2/2"),
        Row("J1_0", str(problem.J1_0), "initial action, dimensionless"),
        Row("J2_0", f"{float(_problem(problem).J2_0(53)):.16g}", "initial |M|, dimensionless"),
        Row("n_symbols", str(problem.n_symbols), "turns from a separatrix to the next"),
        *(
            Row(name, f"theta2_0 = {case.theta2_0}", "rad, initial phase")
            for name, case in problem.cases.items()
        ),
        *(
            Row(f"increment {i}", f"{x:+.6f}", f"rad, of theta3 along separatrix {i}, to O(mu)")
            for i, x in enumerate(gained, 1)
        ),
    ]


def differences(stored: Any, fresh: Any) -> list[str]:
    """Where two results of the same config disagree by more than their arithmetic explains.

    Routes must be the same. Samples may differ by what they change in the time by which the
    two orbits are apart, as the crossings tell.

    Parameters
    ----------
    stored, fresh : dict
        ``/data`` of the two files, loaded.
    """
    found = [f"case {name} is in one file only" for name in sorted(set(stored) ^ set(fresh))]
    for name in sorted(set(stored) & set(fresh)):
        found += [f"{name}: {text}" for text in _case_differences(stored[name], fresh[name])]
    return found


def _case_differences(stored: Any, fresh: Any) -> Iterator[str]:
    absent = [key for key in GROUP if key not in stored or key not in fresh]
    if absent:
        yield f"{', '.join(absent)} is in one file only"
        return
    if stored["route"] != fresh["route"]:
        yield f"route {stored['route']} stored, {fresh['route']} computed"
        return
    shapes = [key for key in GROUP if np.shape(stored[key]) != np.shape(fresh[key])]
    if shapes:
        yield f"{', '.join(shapes)} have other shapes"
        return
    for key in ("codes", "separatrix", "certain", "wound"):
        if not np.array_equal(stored[key], fresh[key]):
            yield f"{key} differ"
    apart = _apart(stored, fresh)
    for key in ("theta2_0", "plateaus", "crossing_time", *SAMPLED):
        yield from _far(key, np.asarray(stored[key]), np.asarray(fresh[key]), apart, fresh["t"])


def _apart(stored: Any, fresh: Any) -> float:
    """By how much time two orbits may be apart, beyond what would be an error in itself."""
    errors = [np.abs(group["crossing_error"]).max() for group in (stored, fresh)]
    return float(min(MARGIN * max(*errors, ROUNDING), LINEAR))


def _far(key: str, stored: Array, fresh: Array, apart: float, t: Array) -> Iterator[str]:
    """Whether values differ by more than they change in the time `apart`."""
    gap = np.abs(stored - fresh)
    if key == "theta1":
        gap = np.minimum(gap, np.abs(4 * np.pi - gap))
    if key == "crossing_time":
        allowed = apart
    elif key in ("theta2_0", "plateaus", "t"):
        allowed = ROUNDING * max(1.0, float(np.abs(fresh).max()))
    else:
        allowed = 1e-12 + apart * float(np.abs(np.diff(fresh, axis=0)).max() / np.diff(t).min())
    if not (gap <= allowed).all():
        yield f"{key} differ by up to {np.max(gap):.3g}, more than {allowed:.3g}"


def _tolerance(config: Any, means: Means) -> float:
    return float(config.numerics.tolerance or integrate.DEFAULT_TOLERANCE[means.engine])


def _problem(problem: Any) -> RouteProblem:
    return RouteProblem(problem.body, problem.h0, problem.J1_0, problem.n_symbols)
