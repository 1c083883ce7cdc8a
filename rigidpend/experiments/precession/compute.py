"""Experiment `precession`: what theta3 gains along the separatrices, true and by (tri1)."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.asymptotic import heteroclinic
from rigidpend.body import Body
from rigidpend.experiments.contract import Data, Means, Row
from rigidpend.experiments.precession.layout import DRAWN, MU_OVER_H0, NAME, OF_BODY
from rigidpend.precession import increments, regime
from rigidpend.results import compare
from rigidpend.results.tree import Dataset, Tree

if TYPE_CHECKING:
    from rigidpend.experiments.precession.schema import Config, Problem


Array = NDArray[np.float64]

SMALL = 1e-2
"""Slopes are fitted where mu/h0 is at most this."""
ROUNDING = 1e-13
"""By how much an increment may be uncertain, relative to the largest of its body: the
integration's rounding, some hundred steps of it."""
SLOPE = 1e-3
"""By how much fitted slopes may differ."""


def compute(config: Config, means: Means) -> Tree:
    """Integrate the heteroclinic orbits of every body at every mu.

    Parameters
    ----------
    config : Config
    means : Means

    Returns
    -------
    Tree
        `mu_over_h0`; `drawn`, the place in it of the mu to be shown; `bodies`, with their
        names and `OF_BODY`.
    """
    problem = config.problem
    found = {
        name: means.part(name, functools.partial(_body, config, name, means))
        for name in problem.bodies
    }
    drawn = problem.mu.index(problem.drawn)
    return {
        "mu_over_h0": MU_OVER_H0.dataset(_mu_over_h0(problem)),
        "drawn": DRAWN.dataset(drawn),
        "bodies": {
            "name": NAME.dataset(_texts(found)),
            **{key: _together(key, found.values()) for key in OF_BODY},
        },
    }


def _body(config: Config, name: str, means: Means) -> Tree:
    """What is told of one body."""
    problem = config.problem
    bodies = [problem.bodies[name].heavy(mu) for mu in problem.mu]
    found = [heteroclinic.increments(body, problem.h0, means.arithmetic) for body in bodies]
    values = _told(bodies, float(problem.h0), found)
    slopes = ", ".join(f"{x:.3f}" for x in values["slope"])
    means.report(f"{name}: {values['regime']}, slopes of the remainder {slopes}")
    return {key: field.dataset(values[key]) for key, field in OF_BODY.items()}


def _told(bodies: list[Body], h0: float, found: list[heteroclinic.Increments]) -> dict[str, Any]:
    first = np.array([increments(body.angles(), h0) for body in bodies])
    gained = np.array([x.gained for x in found])
    unit = np.array([_unit(body, h0) for body in bodies])
    error = np.array([x.error.max() for x in found]) + ROUNDING * unit
    mu_over_h0 = np.array([float(body.mu) for body in bodies]) / h0
    remainder = np.abs(gained - first[:, None]).max(axis=1)
    mean = gained.mean(axis=1)
    mean_remainder = np.abs(mean - first)
    groups = regime(bodies[0]).value
    return {
        "alpha0": bodies[0].alpha0,
        "beta0": bodies[0].beta0,
        "regime": str(regime(bodies[0])),
        "unit": unit,
        "first_order": first,
        "gained": gained,
        "error": error,
        "remainder": remainder,
        "mean_remainder": mean_remainder,
        "slope": _slopes(mu_over_h0, remainder, error),
        "mean_slope": _slopes(mu_over_h0, mean_remainder, error),
        "ordered": np.array([in_order(x, groups, e) for x, e in zip(mean, error, strict=True)]),
    }


def _unit(body: Body, h0: float) -> float:
    """The increment of (tri1) where its sine is one."""
    p = body.angles()
    return float(increments(p._replace(beta0=np.pi - p.alpha0), h0)[1])


def in_order(gained: Array, groups: Iterable[Iterable[int]], error: float) -> bool:
    """Whether the increments of 1, 2, 3, 4 stand in the order of a regime.

    Parameters
    ----------
    gained : (4,) array
    groups : groups of separatrices, 0 for no increment
        Equal inside a group, less in each group than in the one before.
    error : float
        By how much equal increments may differ.
    """
    with_zero = np.array([0.0, *gained])
    sorted_groups = [with_zero[list(group)] for group in groups]
    equal = all(np.ptp(group) <= 2 * error for group in sorted_groups)
    pairs = itertools.pairwise(sorted_groups)
    return bool(equal and all(high.min() > low.max() + 2 * error for high, low in pairs))


def _slopes(mu_over_h0: Array, remainder: Array, error: Array) -> Array:
    """Slopes in mu of (n, 4) values, both logarithmic, from those that are well known."""
    slopes = np.full(remainder.shape[1], np.nan)
    for k, values in enumerate(remainder.T):
        kept = (mu_over_h0 <= SMALL) & (values > 1 / SLOPE * error)
        if kept.sum() >= 2:
            x, y = np.log(mu_over_h0[kept]), np.log(values[kept])
            slopes[k] = np.polyfit(x, y, 1)[0]
    return slopes


def _together(key: str, bodies: Iterable[Tree]) -> Dataset:
    """A field of all bodies, one after the other."""
    values = [getattr(body[key], "values", body[key]) for body in bodies]
    return OF_BODY[key].dataset(_texts(values) if key == "regime" else np.array(values))


def _texts(values: Iterable[Any]) -> Any:
    return np.array([str(x) for x in values], dtype="S")


def _mu_over_h0(problem: Problem) -> Array:
    return np.array([float(mu / problem.h0) for mu in problem.mu])


def describe(config: Config) -> list[Row]:
    """What a config asks for, with what follows from it: for people, units named."""
    problem = config.problem
    return [
        *(
            _body_row(name, shape.heavy(problem.drawn), float(problem.h0))
            for name, shape in problem.bodies.items()
        ),
        Row("h0", str(problem.h0), "energy of the orbits"),
        Row("mu", ", ".join(map(str, problem.mu)), "weight times distance"),
        Row("drawn", str(problem.drawn), "mu at which the increments are shown"),
    ]


def _body_row(name: str, body: Body, h0: float) -> Row:
    first = ", ".join(f"{x:+.5f}" for x in increments(body.angles(), h0))
    meaning = f"rad, along 1, 2, 3, 4 by (tri1) at mu = {body.mu}; {regime(body)}"
    return Row(f"body {name}", first, meaning)


def differences(stored: Data, fresh: Data) -> list[compare.Difference]:
    """Where two results of the same config disagree by more than their arithmetic explains.

    Increments may differ by what is uncertain of both, and remainders by as much.

    Parameters
    ----------
    stored, fresh : dict
        ``/data`` of the two files, loaded.
    """
    found = compare.keys(stored, fresh)
    for key in ("mu_over_h0", "drawn"):
        found += compare.arrays(key, stored[key], fresh[key], ROUNDING)
    old, new = stored["bodies"], fresh["bodies"]
    if np.shape(old["error"]) != np.shape(new["error"]):
        return found + compare.arrays("bodies/error", old["error"], new["error"])
    error = np.asarray(old["error"]) + np.asarray(new["error"])
    allowed = {
        **dict.fromkeys(("alpha0", "beta0", "unit", "first_order"), ROUNDING),
        **dict.fromkeys(("slope", "mean_slope"), SLOPE),
        **dict.fromkeys(("remainder", "mean_remainder"), error[..., None]),
        "gained": error[..., None, None],
        "error": error,
    }
    for key in ("name", *OF_BODY):
        found += compare.arrays(f"bodies/{key}", old[key], new[key], allowed.get(key, 0.0))
    return found
