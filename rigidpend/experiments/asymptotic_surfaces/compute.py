"""Experiment `asymptotic_surfaces`: S1- and S2+ beside separatrix 2, with Table 1 (Fig. 3)."""

from functools import partial
from typing import Any

import numpy as np

from rigidpend.config.description import Row
from rigidpend.experiments.asymptotic_surfaces import ANGLES, WINDOW
from rigidpend.experiments.asymptotic_surfaces.schema import Config, Problem
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.shared import attributes
from rigidpend.machine.wording import counted
from rigidpend.mechanics.pendulum import Delta_1
from rigidpend.numbers.exact import context
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.surfaces import curves as surfaces


def compute(config: Config, means: Means) -> Tree:
    """Compute Table 1 and the two surfaces of every body."""
    problems = _problems(config.problem)
    groups: dict[str, Tree] = {}
    for name, checked in problems.items():
        groups[name] = means.part(name, partial(_body, config, checked, means))
        curves = groups[name]["S1_minus"]
        n, points = curves["theta2_0"].size, curves["theta1"].size
        means.report(f"{name}: {counted(n, 'orbit')}, {counted(points, 'point')}")
    table = attributes(ANGLES, [checked.body for checked in problems.values()])
    return {"table": table, "bodies": groups}


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes on one core."""
    orbits = config.problem.theta2_0.count
    return sum(surfaces.expected_seconds(x, orbits) for x in _problems(config.problem).values())


def _body(config: Config, checked: RouteProblem, means: Means) -> Tree:
    """Compute the window and the two surfaces of a body."""
    theta2_0 = Phases(config.problem.theta2_0.phases).high
    window = _window(checked, float(config.problem.half_width))
    angles, half_width = checked.body.angles(), window["window"][1] - window["centre"]
    lower = surfaces.S1_minus(checked, theta2_0, half_width, *means.arithmetic[:2])
    upper = surfaces.S2_plus(lower, angles.alpha0, angles.beta0)
    return {**window, "S1_minus": lower._asdict(), "S2_plus": upper._asdict()}


def describe(config: Config) -> list[Row]:
    """Table 1: the angles of each body."""
    rows = []
    for name, checked in _problems(config.problem).items():
        body, A = checked.body, ", ".join(map(str, checked.body.A))
        angles = f"alpha0 = {body.alpha0:.5f}, gamma0 = {body.gamma0:.5f}, nu = {body.nu:.3f}"
        rows.append(Row(f"body {name}", angles, f"rad, rad, 1; A = ({A})"))
    return rows


def _problems(problem: Problem) -> dict[str, RouteProblem]:
    further = problem.beta0, problem.mu, problem.M_0, problem.J1_0
    return {name: surfaces.surface_problem(A, *further) for name, A in problem.bodies.items()}


def _window(checked: RouteProblem, half_width: float) -> dict[str, Any]:
    # In more bits than doubles, in which the sine of a thin body's alpha0, near pi, is lost.
    m = context(113)
    p, sides = checked.body.angles(m.prec), np.array([-1, 1])
    centre, delta = float(p.alpha0 + p.beta0), float(Delta_1(p, checked.h0.at(m.prec), 1, m))
    step = surfaces.times(checked)[1]
    # Near its periodic orbit a surface has the width of that orbit's swing Delta_1 (dt).
    born, window = centre + delta * sides, centre + half_width * delta * sides
    return dict(zip(WINDOW, (centre, delta, born, window, step), strict=True))
