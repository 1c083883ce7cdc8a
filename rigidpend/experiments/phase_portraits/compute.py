"""Experiment `phase_portraits`: the Euler case on the sphere and in the plane (Fig. 1)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree, datasets
from rigidpend.experiments.phase_portraits import LAYOUT
from rigidpend.mechanics import free_body
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import TURN
from rigidpend.mechanics.equations import hamiltonian_J3_0

if TYPE_CHECKING:
    from rigidpend.experiments.phase_portraits.schema import Config, Problem


AXIS = 1.4
"""Length of the axes as drawn, in units of |M|."""


class PortraitCurves(NamedTuple):
    """Curves on the sphere and their images in the plane."""

    M: list[NDArray[np.float64]]
    theta1: list[Any]
    J1: list[Any]


def compute(config: Config, means: Means) -> Tree:
    """Compute both phase portraits of a config, all in closed form.

    Returns
    -------
    Tree
        The groups orbits, separatrices, centres, sphere and plane.
    """
    problem = config.problem
    body, axes = problem.body, view_axes(problem.view)
    orbits, separatrices = _orbits(problem), _separatrices(body, problem.points)
    means.report(f"{len(orbits.M)} orbits, {len(separatrices.M)} separatrices, closed form")
    numbers = np.array(free_body.SEPARATRICES, dtype=np.uint8)
    places = free_body.separatrix_theta1(body.alpha0, body.beta0)
    places, phi = np.append(places, places[0] + 2 * TURN), np.linspace(0, TURN, problem.points)
    # In the order of `_orbits`: both sides of axis 2, then of axis 1, each with every height.
    heights = np.tile([float(x) for x in problem.heights], 4)
    families = np.repeat(np.array([2, 2, 1, 1], dtype=np.uint8), len(problem.heights))
    groups = {
        "orbits": {**_group(orbits, body, axes), "height": heights, "around": families},
        "separatrices": {
            **_group(separatrices, body, axes),
            "number": numbers,
        },
        "centres": _group(_centres(body), body, axes),
        "sphere": {
            "outline": np.stack((np.cos(phi), np.sin(phi))),
            "axis_feet": axes.copy(),
            "axis_tips": AXIS * axes,
        },
        "plane": {
            "window": places[[0, -1]],
            "separatrix_theta1": places,
            "separatrix": np.append(numbers, numbers[0]),
        },
    }
    return datasets(LAYOUT, groups)


def view_axes(view: Any) -> NDArray[np.float64]:
    """Unit vectors to the right, upwards and towards the viewer, the rows of a rotation."""
    azimuth, elevation = float(view.azimuth), float(view.elevation)
    (sina, cosa), (sine, cose) = ((np.sin(x), np.cos(x)) for x in (azimuth, elevation))
    right, up = (-sina, cosa, 0.0), (-sine * cosa, -sine * sina, cose)
    return np.array([right, up, (cose * cosa, cose * sina, sine)])


def _orbits(problem: Problem) -> PortraitCurves:
    body, phi = problem.body, np.linspace(0, TURN, problem.points)
    families = [(f, side) for f in (free_body.around_M2, free_body.around_M1) for side in (1, -1)]
    heights = [float(x) for x in problem.heights]
    return _curves(body, [f(body.alpha0, h, side, phi) for f, side in families for h in heights])


def _centres(body: Body) -> PortraitCurves:
    """Rotations about the axes of M2 and M1, as curves of one point."""
    points = [side * np.eye(3)[:, [axis]] for axis in (1, 0) for side in (1, -1)]
    return _curves(body, points)


def _curves(body: Body, M: list[NDArray[np.float64]]) -> PortraitCurves:
    # Cut at separatrix 1, which no orbit crosses: none falls apart at the edge of the window.
    start = body.beta0 - body.alpha0
    plane = [free_body.in_plane(points, body.beta0, start) for points in M]
    return PortraitCurves(M, [x for x, _ in plane], [y for _, y in plane])


def _separatrices(body: Body, n: int) -> PortraitCurves:
    """Separatrices from pole to pole; theta1 is not defined there, but its limit is."""
    phi = np.linspace(-TURN / 4, TURN / 4, n)
    M = [free_body.half_circle(body.alpha0, number, phi) for number in free_body.SEPARATRICES]
    places = free_body.separatrix_theta1(body.alpha0, body.beta0)
    return PortraitCurves(M, [np.full(n, x) for x in places], [(1 + points[2]) / 2 for points in M])


def _group(curves: PortraitCurves, body: Body, axes: NDArray[np.float64]) -> dict[str, Any]:
    points = np.concatenate(curves.M, axis=1)
    offsets = np.cumsum([0, *(M.shape[1] for M in curves.M)])
    projected = axes @ points
    free = body.angles()._replace(mu=0.0)
    # The energy of a curve, at its middle: at the poles, where separatrices end, theta1 is a limit.
    middle = [
        (J1[len(J1) // 2], x[len(x) // 2]) for J1, x in zip(curves.J1, curves.theta1, strict=True)
    ]
    energy = np.array([hamiltonian_J3_0(J1, 1.0, (x, 0.0), free, np) for J1, x in middle])
    return {
        "points": points,
        "offsets": offsets,
        "projected": projected,
        "visible": projected[2] >= 0,
        "theta1": np.concatenate(curves.theta1),
        "J1": np.concatenate(curves.J1),
        "arrows": _arrows(offsets),
        "energy": energy,
        "level": energy - free.kappa / 2,
    }


def _arrows(offsets: Any) -> Any:
    """Indices of the arrows: a quarter and three quarters along each curve."""
    sizes = np.diff(offsets)
    # A centre is a curve of one point, and bears no arrow.
    starts = offsets[:-1][sizes > 4]
    return np.ravel([starts + part * sizes[sizes > 4] // 4 for part in (1, 3)])
