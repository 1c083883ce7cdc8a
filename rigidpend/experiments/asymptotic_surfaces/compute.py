"""Experiment `asymptotic_surfaces`: S1- and S2+ beside separatrix 2, with Table 1 (Fig. 3)."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.config.description import Row, exact_row
from rigidpend.experiments.asymptotic_surfaces.layout import ANGLES, CURVES, WINDOW
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import compare
from rigidpend.experiments.data.compare import Difference
from rigidpend.experiments.data.layout import datasets
from rigidpend.experiments.data.tree import Data, Tree
from rigidpend.mechanics.periodic import Delta_1
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.surfaces import curves as surfaces
from rigidpend.surfaces.curves import SurfaceCurves

if TYPE_CHECKING:
    from rigidpend.experiments.asymptotic_surfaces.schema import Config, Problem


DRIFT = 1e-12
"""Allowed difference of theta1 (radians) and J1/J2 where orbits neither approach nor leave."""


def compute(config: Config, means: Means) -> Tree:
    """Compute Table 1 and the two surfaces of every body.

    Returns
    -------
    Tree
        `table` with an array for each column; `bodies` with a group for each body.
    """
    problems = _problems(config.problem)
    groups: dict[str, Tree] = {}
    for name, checked in problems.items():
        groups[name] = means.part(name, partial(_body, config, checked, means))
        curves: Any = groups[name]["S1_minus"]
        sizes = curves["theta2_0"].values.size, curves["theta1"].values.size
        means.report(f"{name}: {sizes[0]} orbits, {sizes[1]} points")
    return {"table": _table(problems), "bodies": groups}


def _body(config: Config, checked: RouteProblem, means: Means) -> Tree:
    """Compute the window and the two surfaces of a body."""
    theta2_0 = Phases(config.problem.theta2_0.phases).high
    window = _window(checked, float(config.problem.half_width))
    angles, half_width = checked.body.angles(), window["window"][1] - window["centre"]
    lower = surfaces.S1_minus(checked, theta2_0, half_width, *means.arithmetic[:2])
    upper = surfaces.S2_plus(lower, angles.alpha0, angles.beta0)
    both = {
        name: datasets(CURVES[name], curves._asdict())
        for name, curves in (("S1_minus", lower), ("S2_plus", upper))
    }
    return {**datasets(WINDOW, window), **both}


def describe(config: Config) -> list[Row]:
    """Describe a config in rows, with Table 1, units named."""
    problem, problems = config.problem, _problems(config.problem)
    grid = problem.theta2_0
    return [
        *(_body_row(name, checked) for name, checked in problems.items()),
        Row("beta0", str(problem.beta0 or "gamma0"), "rad; gamma0 is Grioli's condition"),
        exact_row("mu", "weight times distance of the centre of gravity", problem.mu),
        exact_row("M_0", "initial |M|, physical; h0 = M_0^2/(2 A3)", problem.M_0),
        exact_row("J1_0", "initial action, dimensionless", problem.J1_0),
        Row("theta2_0", f"{grid.start} + k {grid.step}, k < {grid.count}", "rad, initial phases"),
        exact_row("half_width", "of the window, in Delta_1", problem.half_width),
    ]


def differences(stored: Data, fresh: Data) -> list[Difference]:
    """Find where two results of a config disagree by more than their arithmetic explains.

    Curves are compared at the times that both hold: which samples are kept may hang on the
    last digit. By eq. (dtheta) an error of theta1 grows as J2^2/(J1 (J2 - J1)).
    """
    if found := compare.keys(stored, fresh):
        return found
    found = compare.inside("table", _rounded(stored["table"], fresh["table"], ANGLES))
    return found + compare.members(stored["bodies"], fresh["bodies"], _body_differences, "bodies")


def _body_differences(stored: Data, fresh: Data) -> list[Difference]:
    if found := compare.keys(stored, fresh):
        return found
    found = _rounded(stored, fresh, WINDOW)
    for surface in CURVES:
        found += compare.inside(surface, _curves_apart(stored[surface], fresh[surface]))
    return found


def _rounded(stored: Data, fresh: Data, fields: Any) -> list[Difference]:
    """Compare numbers of closed form, up to their rounding."""
    found = compare.keys(stored, fresh)
    for field in [field for field in fields if field in stored and field in fresh]:
        allowed = compare.ROUNDING * np.abs(stored[field])
        found += compare.arrays(field, stored[field], fresh[field], allowed)
    return found


def _curves_apart(stored: Data, fresh: Data) -> list[Difference]:
    if found := compare.keys(stored, fresh):
        return found
    old, new = (
        SurfaceCurves(*(np.asarray(group[field]) for field in SurfaceCurves._fields))
        for group in (stored, fresh)
    )
    if old.theta2_0.shape != new.theta2_0.shape:
        return compare.arrays("theta2_0", old.theta2_0, new.theta2_0)
    # Phases are modulo 2 pi: rounding may have put one at 0 and its equal just below a turn.
    turned = np.angle(np.exp(1j * (new.theta2_0 - old.theta2_0)))
    found = compare.arrays("theta2_0", old.theta2_0, old.theta2_0 + turned, 1e3 * compare.ROUNDING)
    # Which samples are kept may differ, and the offsets with them; their ends may not.
    ends = compare.arrays("offsets", [0, new.theta1.size], new.offsets[[0, -1]])
    if ends:
        return found + ends
    here, there = _shared(old, new)
    # Two results with few times in common would agree by having nothing to be compared.
    if here.size < 0.9 * max(old.theta1.size, new.theta1.size):
        said = f": only {here.size} of {old.theta1.size} points are at the same times"
        return [*found, Difference("sample", old.theta1.size, here.size, words=said)]
    J1, at = old.J1_over_J2, np.full(old.theta1.size, -1)
    at[here] = there
    # Where the other result has no point, there is nothing to compare.
    height = np.where(at < 0, np.inf, DRIFT)
    # J1 (J2 - J1) of (dtheta), in units of its value at the section, where the factor is 1.
    across = height / (4 * J1 * (1 - J1))
    found += compare.arrays("theta1", old.theta1, new.theta1[at], across)
    return found + compare.arrays("J1_over_J2", J1, new.J1_over_J2[at], height)


def _shared(a: SurfaceCurves, b: SurfaceCurves) -> tuple[Any, Any]:
    """Find the points of two results that belong to the same orbit and time."""
    # Curve and time in one integer, for intersect1d knows no pairs; times are below 2^31.
    first, second = (
        np.repeat(np.arange(c.offsets.size - 1), np.diff(c.offsets)) * 2**32 + c.sample
        for c in (a, b)
    )
    _, here, there = np.intersect1d(first, second, return_indices=True)
    return here, there


def _problems(problem: Problem) -> dict[str, RouteProblem]:
    further = problem.beta0, problem.mu, problem.M_0, problem.J1_0
    return {name: surfaces.surface_problem(A, *further) for name, A in problem.bodies.items()}


def _window(checked: RouteProblem, half_width: float) -> dict[str, Any]:
    p, h0 = checked.body.angles(), float(checked.h0)
    centre, delta, sides = p.alpha0 + p.beta0, Delta_1(p, h0, 1, math), np.array([-1, 1])
    step = surfaces.times(checked)[1]
    # Surfaces are born with the swing Delta_1 of their periodic orbit (dt).
    born, window = centre + delta * sides, centre + half_width * delta * sides
    return dict(zip(WINDOW, (centre, delta, born, window, step), strict=True))


def _table(problems: dict[str, RouteProblem]) -> Tree:
    columns = {
        field: np.array([getattr(checked.body, field) for checked in problems.values()])
        for field in ANGLES
    }
    return datasets(ANGLES, columns)


def _body_row(name: str, checked: RouteProblem) -> Row:
    body = checked.body
    A = ", ".join(map(str, body.A))
    angles = f"alpha0 = {body.alpha0:.5f}, gamma0 = {body.gamma0:.5f}, nu = {body.nu:.3f}"
    return Row(f"body {name}", angles, f"rad, rad, 1; A = ({A})")
