"""Experiment `asymptotic_surfaces`: S1- and S2+ beside separatrix 2, with Table 1 (Fig. 3)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from rigidpend import surfaces
from rigidpend.experiments import Means, Row
from rigidpend.periodic import Delta_1
from rigidpend.routes.phases import Grid, Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.surfaces import Curves
from rigidpend.tree import Dataset, Tree

ROUNDING = 1e-14
"""By how much numbers of closed form may differ, relative."""
DRIFT = 1e-12
"""By how much theta1 and J1/J2 may differ where orbits neither approach nor leave."""

ANGLES = {
    "alpha0": ("rad", "alpha0 of each body, in the order of the bodies"),
    "gamma0": ("rad", "gamma0 of each body"),
    "nu": ("1", "pi kappa/sin(alpha0) of each body"),
}
WINDOW = {
    "centre": ("rad", "alpha0 + beta0, theta1 on separatrix 2"),
    "Delta_1": ("rad", "largest |theta1 - alpha0 - beta0| near T1 and T2, eq. (dt)"),
    "born": ("rad", "centre -+ Delta_1"),
    "window": ("rad", "centre -+ half_width Delta_1"),
    "time_step": ("t' = t s", "step between samples"),
}
CURVES = {
    "theta1": ("rad", "all curves, one after the other"),
    "J1_over_J2": ("1", "all curves, one after the other"),
    "sample": ("1", "time of each point in time_step, from the start; S2+ runs backward"),
    "offsets": ("1", "curve k is offsets[k]:offsets[k + 1]"),
    "theta2_0": ("rad", "theta2 at the start of each orbit"),
}


def compute(config: Any, means: Means) -> Tree:
    """Compute Table 1 and the two surfaces of every body.

    Parameters
    ----------
    config : rigidpend.config.schema.asymptotic_surfaces.Config
    means : Means

    Returns
    -------
    Tree
        `table` with an array for each column; `bodies` with a group for each body.
    """
    problem, numerics = config.problem, config.numerics
    tolerance = None if numerics.tolerance is None else float(numerics.tolerance)
    problems = _problems(problem)
    grid = problem.theta2_0
    theta2_0 = Phases(Grid(grid.start, grid.step, grid.count)).high
    groups: dict[str, Tree] = {}
    for name, checked in problems.items():
        window = _window(checked, float(problem.half_width))
        angles, half_width = checked.body.angles(), window["window"][1] - window["centre"]
        lower = surfaces.S1_minus(checked, theta2_0, half_width, means.engine, tolerance)
        upper = surfaces.S2_plus(lower, angles.alpha0, angles.beta0)
        means.report(f"{name}: {theta2_0.size} orbits, {lower.theta1.size} points")
        both = {"S1_minus": _curves(lower), "S2_plus": _curves(upper)}
        groups[name] = {**_datasets(window, WINDOW), **both}
    return {"table": _table(problems), "bodies": groups}


def describe(config: Any) -> list[Row]:
    """What a config asks for, with Table 1: for people, units named."""
    problem, problems = config.problem, _problems(config.problem)
    grid = problem.theta2_0
    return [
        *(_body_row(name, checked) for name, checked in problems.items()),
        Row("beta0", str(problem.beta0 or "gamma0"), "rad; gamma0 is Grioli's condition"),
        Row("mu", str(problem.mu), "weight times distance of the centre of gravity"),
        Row("M_0", str(problem.M_0), "initial |M|, physical; h0 = M_0^2/(2 A3)"),
        Row("J1_0", str(problem.J1_0), "initial action, dimensionless"),
        Row("theta2_0", f"{grid.start} + k {grid.step}, k < {grid.count}", "rad, initial phases"),
        Row("half_width", str(problem.half_width), "of the window, in Delta_1"),
    ]


def differences(stored: Any, fresh: Any) -> list[str]:
    """Where two results of the same config disagree by more than their arithmetic explains.

    Curves are compared at the times that both hold: which samples are kept may hang on the
    last digit. By eq. (dtheta) an error of theta1 grows as J2^2/(J1 (J2 - J1)).

    Parameters
    ----------
    stored, fresh : dict
        ``/data`` of the two files, loaded.
    """
    found = list(_apart("table", stored["table"], fresh["table"], ANGLES))
    old, new = stored["bodies"], fresh["bodies"]
    if list(old) != list(new):
        return [*found, f"bodies {', '.join(old)} stored, {', '.join(new)} computed"]
    for name in old:
        found += _apart(name, old[name], new[name], WINDOW)
        for surface in ("S1_minus", "S2_plus"):
            found += _curves_apart(f"{name}/{surface}", old[name][surface], new[name][surface])
    return found


def _apart(place: str, stored: Any, fresh: Any, fields: Any) -> Iterator[str]:
    for field in fields:
        a, b = np.asarray(stored[field]), np.asarray(fresh[field])
        if a.shape != b.shape or not np.allclose(a, b, rtol=ROUNDING, atol=0):
            yield f"{place}/{field}: stored {a}, computed {b}"


def _curves_apart(place: str, stored: Any, fresh: Any) -> Iterator[str]:
    old, new = (
        Curves(*(np.asarray(group[field]) for field in CURVES)) for group in (stored, fresh)
    )
    if old.theta2_0.shape != new.theta2_0.shape:
        yield f"{place}: {old.theta2_0.size} curves stored, {new.theta2_0.size} computed"
        return
    turns = np.abs(np.exp(1j * old.theta2_0) - np.exp(1j * new.theta2_0))
    if not (turns <= 1e3 * ROUNDING).all():
        yield f"{place}/theta2_0: differ by {turns.max():.2g}"
    here, there = _shared(old, new)
    if here.size < 0.9 * max(old.theta1.size, new.theta1.size):
        yield f"{place}: only {here.size} of {old.theta1.size} points are at the same times"
        return
    ratio = old.J1_over_J2[here]
    gaps = {
        "theta1": np.abs(old.theta1[here] - new.theta1[there]) * 4 * ratio * (1 - ratio),
        "J1_over_J2": np.abs(ratio - new.J1_over_J2[there]),
    }
    for field, gap in gaps.items():
        if not (gap <= DRIFT).all():
            yield f"{place}/{field}: differ by {gap.max():.2g}, {DRIFT} is explained"


def _shared(a: Curves, b: Curves) -> tuple[Any, Any]:
    """The points of two results that belong to the same orbit and time."""
    first, second = (
        np.repeat(np.arange(c.offsets.size - 1), np.diff(c.offsets)) * 2**32 + c.sample
        for c in (a, b)
    )
    _, here, there = np.intersect1d(first, second, return_indices=True)
    return here, there


def _problems(problem: Any) -> dict[str, RouteProblem]:
    further = problem.beta0, problem.mu, problem.M_0, problem.J1_0
    return {name: surfaces.surface_problem(A, *further) for name, A in problem.bodies.items()}


def _window(checked: RouteProblem, half_width: float) -> dict[str, Any]:
    p, h0 = checked.body.angles(), float(checked.h0)
    centre, delta, sides = p.alpha0 + p.beta0, Delta_1(p, h0, 1, math), np.array([-1, 1])
    step = surfaces.times(checked)[1]
    born, window = centre + delta * sides, centre + half_width * delta * sides
    return dict(zip(WINDOW, (centre, delta, born, window, step), strict=True))


def _table(problems: dict[str, RouteProblem]) -> Tree:
    columns = {
        field: np.array([getattr(checked.body, field) for checked in problems.values()])
        for field in ANGLES
    }
    return _datasets(columns, ANGLES)


def _datasets(values: Any, meaning: Any) -> dict[str, Dataset]:
    return {field: Dataset(values[field], *meaning[field]) for field in meaning}


def _curves(curves: Curves) -> Tree:
    return _datasets(curves._asdict(), CURVES)


def _body_row(name: str, checked: RouteProblem) -> Row:
    body = checked.body
    A = ", ".join(map(str, body.A))
    angles = f"alpha0 = {body.alpha0:.5f}, gamma0 = {body.gamma0:.5f}, nu = {body.nu:.3f}"
    return Row(f"body {name}", angles, f"rad, rad, 1; A = ({A})")
