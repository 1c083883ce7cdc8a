"""Experiment `phase_portraits`: the Euler case on the sphere and in the plane (Fig. 1)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.phase_portraits.schema import Config
from rigidpend.mechanics import free_body
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import TURN
from rigidpend.mechanics.equations import hamiltonian_J3_0
from rigidpend.numbers.generic import Array

AXIS = 1.4
"""Length of the axes as drawn, in units of |M|."""


class Curves(NamedTuple):
    """Curves on the sphere, and their images (theta1, J1/J2) in the plane."""

    M: list[Array]
    plane: list[tuple[Array, Array]]


def compute(config: Config, means: Means) -> Tree:
    """Compute both phase portraits of a config, all in closed form."""
    problem = config.problem
    body, axes, phi = problem.body, view_axes(problem.view), np.linspace(0, TURN, problem.points)
    sides = [(f, side) for f in (free_body.around_M2, free_body.around_M1) for side in (1, -1)]
    heights = [float(x) for x in problem.heights]
    orbits = _drawn(body, [f(body.alpha0, h, side, phi) for f, side in sides for h in heights])
    # Rotations about the axes of M2 and M1, as curves of one point.
    centres = _drawn(body, [x * np.eye(3)[:, [axis]] for axis in (1, 0) for x in (1, -1)])
    separatrices = _separatrices(body, problem.points)
    means.report(f"{len(orbits.M)} orbits, {len(separatrices.M)} separatrices, closed form")
    numbers = np.array(free_body.SEPARATRICES, dtype=np.uint8)
    places = free_body.separatrix_theta1(body.alpha0, body.beta0)
    places = np.append(places, places[0] + 2 * TURN)
    return {
        "orbits": {
            **_group(orbits, body, axes),
            "height": np.tile(heights, len(sides)),
            "around": np.repeat(np.array([2, 2, 1, 1], dtype=np.uint8), len(heights)),
        },
        "separatrices": {**_group(separatrices, body, axes), "number": numbers},
        "centres": _group(centres, body, axes),
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


def view_axes(view: Any) -> Array:
    """Unit vectors to the right, upwards and towards the viewer, the rows of a rotation."""
    azimuth, elevation = float(view.azimuth), float(view.elevation)
    (sina, cosa), (sine, cose) = ((np.sin(x), np.cos(x)) for x in (azimuth, elevation))
    right, up = (-sina, cosa, 0.0), (-sine * cosa, -sine * sina, cose)
    return np.array([right, up, (cose * cosa, cose * sina, sine)])


def _drawn(body: Body, M: list[Array]) -> Curves:
    # Cut at separatrix 1, which no orbit crosses: none falls apart at the edge of the window.
    start = body.beta0 - body.alpha0
    return Curves(M, [free_body.in_plane(points, body.beta0, start) for points in M])


def _separatrices(body: Body, n: int) -> Curves:
    """Separatrices from pole to pole; theta1 is not defined there, but its limit is."""
    phi = np.linspace(-TURN / 4, TURN / 4, n)
    M = [free_body.half_circle(body.alpha0, number, phi) for number in free_body.SEPARATRICES]
    places = free_body.separatrix_theta1(body.alpha0, body.beta0)
    both = zip(places, M, strict=True)
    return Curves(M, [(np.full(n, x), (1 + points[2]) / 2) for x, points in both])


def _group(curves: Curves, body: Body, axes: Array) -> dict[str, Any]:
    points = np.concatenate(curves.M, axis=1)
    offsets = np.cumsum([0, *(M.shape[1] for M in curves.M)])
    projected = axes @ points
    free = body.angles()._replace(mu=0.0)
    # The energy of a curve, at its middle: at the poles, where separatrices end, theta1 is a limit.
    middle = [(J1[len(J1) // 2], x[len(x) // 2]) for x, J1 in curves.plane]
    energy = np.array([hamiltonian_J3_0(J1, 1.0, (x, 0.0), free, np) for J1, x in middle])
    return {
        "points": points,
        "offsets": offsets,
        "projected": projected,
        "visible": projected[2] >= 0,
        "theta1": np.concatenate([theta1 for theta1, _ in curves.plane]),
        "J1": np.concatenate([J1 for _, J1 in curves.plane]),
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
