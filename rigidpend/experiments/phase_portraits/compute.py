"""Experiment `phase_portraits`: the Euler case on the sphere and in the plane (Fig. 1)."""

from typing import Any

import numpy as np

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.phase_portraits.schema import Config
from rigidpend.mechanics import free_body
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import TURN, cos_sin_half
from rigidpend.numbers import Array

OUTLINE = 241
"""Number of points of the sphere's outline, round also where orbits have few."""
AXIS = 1.4
"""Length of the axes as drawn, in units of |M|."""


def compute(config: Config, means: Means) -> Tree:
    """Compute both phase portraits of a config, all in closed form."""
    problem = config.problem
    body, axes = problem.body, view_axes(problem.view)
    phi, around = (np.linspace(0, TURN, points) for points in (problem.points, OUTLINE))
    sides = [(f, side) for f in (free_body.around_M2, free_body.around_M1) for side in (1, -1)]
    heights = [float(x) for x in problem.heights]
    alpha0 = body.angles(113).alpha0
    every = [f(alpha0, h, side, phi) for f, side in sides for h in heights]
    orbits = _group(np.concatenate(every, axis=1), problem.points, body, axes)
    # Rotations about the axes of M2 and M1, as curves of one point.
    centres = _group(np.eye(3)[:, [1, 1, 0, 0]] * (1, -1, 1, -1), 1, body, axes)
    separatrices = _separatrices(problem.points, body, axes)
    means.report(f"{len(every)} orbits, {len(free_body.SEPARATRICES)} separatrices, closed form")
    numbers = np.array(free_body.SEPARATRICES, dtype=np.uint8)
    places = free_body.separatrix_theta1(body.alpha0, body.beta0)
    places = np.append(places, places[0] + 2 * TURN)
    return {
        "orbits": {
            **orbits,
            "height": np.tile(heights, len(sides)),
            "around": np.repeat(np.array([2, 2, 1, 1], dtype=np.uint8), len(heights)),
        },
        "separatrices": {**separatrices, "number": numbers},
        "centres": centres,
        "sphere": {
            "outline": np.stack((np.cos(around), np.sin(around))),
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


def _separatrices(n: int, body: Body, axes: Array) -> dict[str, Any]:
    """Separatrices from pole to pole; at the poles theta1 is not defined, and its limit is used."""
    phi = np.linspace(-TURN / 4, TURN / 4, n)
    alpha0 = body.angles(113).alpha0
    M = [free_body.half_circle(alpha0, number, phi) for number in free_body.SEPARATRICES]
    points = np.concatenate(M, axis=1)
    theta1 = np.repeat(free_body.separatrix_theta1(body.alpha0, body.beta0), n)
    return _group(points, n, body, axes, (theta1, (1 + points[2]) / 2))


def _group(
    points: Array, n: int, body: Body, axes: Array, plane: tuple[Array, Array] | None = None
) -> dict[str, Any]:
    """Curves of n points each, one after the other; theta1 and J1/J2 as given, or from M."""
    # Quarters of the points go around M2, -M2, M1 and -M1, which lie at these theta1: beside a
    # separatrix, where rounding may put a point beyond the window's edge, no curve is cut.
    middle = body.beta0 + np.repeat((0.0, 2.0, 1.0, 3.0), points.shape[1] // 4) * np.pi
    theta1, J1 = free_body.in_plane(points, body.beta0, middle) if plane is None else plane
    projected = axes @ points
    begins = np.arange(0, points.shape[1], n)
    # The level by itself: beside kappa/2 of a nearly symmetric body it would be rounded off. By the
    # form of `free_body` as a product: by theta1 it would be lost where alpha0 is near pi.
    cos, sin = cos_sin_half(body.angles(113).alpha0)
    M1, M2, _ = points[:, begins + n // 2]
    level = (sin * M2 - cos * M1) * (sin * M2 + cos * M1) / 2
    # Arrows a quarter and three quarters along each curve; a curve of one point has none.
    arrows = np.ravel([begins + part * n // 4 for part in (1, 3)]) if n > 1 else begins[:0]
    return {
        "points": points,
        "offsets": np.append(begins, points.shape[1]),
        "projected": projected,
        "visible": projected[2] >= 0,
        "theta1": theta1,
        "J1": J1,
        "arrows": arrows,
        "energy": body.kappa / 2 + level,
        "level": level,
    }
