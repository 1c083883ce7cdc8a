"""Experiment `splitting`: the distance of S1- and S2+ on J1 = J2/2, true and by Melnikov."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.asymptotic import section
from rigidpend.asymptotic.splitting import COARSEST, TOP, Splitting, amplitude, distance, measure
from rigidpend.body import Body
from rigidpend.experiments.contract import Data, Means, Row
from rigidpend.experiments.splitting.layout import CLOSED_FORM, CURVE, MU_OVER_H0, NAME, OF_BODY
from rigidpend.results import compare
from rigidpend.results.tree import Dataset, Tree

if TYPE_CHECKING:
    from rigidpend.experiments.splitting.schema import Config, Problem


Array = NDArray[np.float64]

ROUNDING = 1e-13
"""By how much numbers of closed form may differ, relative."""
MARGIN = 2
"""Two results may differ by this many times the larger of their errors."""
SMALL = 1e-2
"""Slopes are fitted where mu/h0 is at most this."""
GRID = np.linspace(-np.pi, np.pi, 721)
"""Phases among which the largest distances are looked for."""


def compute(config: Config, means: Means) -> Tree:
    """Measure the splitting of every body at every mu.

    Parameters
    ----------
    config : Config
    means : Means

    Returns
    -------
    Tree
        `mu_over_h0`; `bodies`, with their names and `OF_BODY`; `curve`, the distance of one
        body; `closed_form`, nu/sinh(nu) along nu.
    """
    problem = config.problem
    found = {
        name: means.part(name, functools.partial(_body, config, name, means))
        for name in problem.bodies
    }
    return {
        "mu_over_h0": MU_OVER_H0.dataset(_mu_over_h0(problem)),
        "bodies": {
            "name": NAME.dataset(np.array(list(found), dtype="S")),
            **{key: _together(key, found.values()) for key in OF_BODY},
        },
        "curve": _curve(problem, found[problem.drawn]),
        "closed_form": _closed_form(max(_values(body["nu"]) for body in found.values())),
    }


def _body(config: Config, name: str, means: Means) -> Tree:
    """What is told of one body."""
    problem = config.problem
    bodies = [problem.bodies[name].heavy(mu) for mu in problem.mu]
    found = [measure(body, problem.h0, means.arithmetic, means.jobs) for body in bodies]
    means.report(f"{name}: nu = {bodies[0].nu:.2f}, {_summary(found)}")
    values = _told(bodies[0], found, _mu_over_h0(problem))
    return {key: field.dataset(values[key]) for key, field in OF_BODY.items()}


def _told(body: Body, found: list[Splitting], mu_over_h0: Array) -> dict[str, Any]:
    excess, amplitude = (
        np.array([getattr(x, key) for x in found]) for key in ("excess", "amplitude")
    )
    whole = excess + np.eye(1, excess.shape[1])
    curve_excess = _largest(excess)
    return {
        **{key: getattr(body, key) for key in ("alpha0", "beta0", "nu")},
        **{
            key: np.array([getattr(x, key) for x in found]) for key in ("error", "resolved", "bits")
        },
        "orbits": np.array([x.n for x in found]),
        "amplitude": amplitude,
        "excess": excess,
        "reduced": whole[:, 0] * _decay(body.nu),
        "largest": amplitude * _largest(whole),
        "curve_excess": curve_excess,
        "slope_amplitude": _slope(mu_over_h0, np.abs(excess[:, 0])),
        "slope_curve": _slope(mu_over_h0, curve_excess),
    }


def _together(key: str, bodies: Iterable[Tree]) -> Dataset:
    """A field of all bodies, one after the other."""
    return OF_BODY[key].dataset(np.array([_values(body[key]) for body in bodies]))


def _largest(harmonics: Array) -> Array:
    """The largest |distance| over all phases, for harmonics (n, k)."""
    return np.array([np.abs(distance(row, GRID)).max() for row in harmonics])


def _decay(nu: Any) -> Any:
    """nu/sinh(nu), by which Melnikov's amplitude is exponentially small."""
    return nu / np.sinh(nu)


def _slope(mu_over_h0: Array, values: Array) -> float:
    """The slope of values in mu, both logarithmic, where mu is small; NaN for less than two."""
    kept = (mu_over_h0 <= SMALL) & (values > 0)
    if kept.sum() < 2:
        return float("nan")
    return float(np.polyfit(np.log(mu_over_h0[kept]), np.log(values[kept]), 1)[0])


def _curve(problem: Problem, body: Tree) -> Tree:
    g = np.linspace(-np.pi, np.pi, problem.phases)
    excess = np.where(_values(body["resolved"])[:, None], _values(body["excess"]), np.nan)
    measured = [np.cos(g) + distance(row, g) for row in excess]
    values = {
        "body": problem.drawn,
        "g": g,
        "melnikov": np.cos(g),
        "measured": np.stack(measured),
    }
    return {name: field.dataset(values[name]) for name, field in CURVE.items()}


def _closed_form(most: float) -> Tree:
    nu = np.linspace(0.5, np.ceil(most + 1), 100)
    values = {"nu": nu, "decay": _decay(nu)}
    return {name: field.dataset(values[name]) for name, field in CLOSED_FORM.items()}


def _mu_over_h0(problem: Problem) -> Array:
    return np.array([float(mu / problem.h0) for mu in problem.mu])


def _values(dataset: Any) -> Any:
    return getattr(dataset, "values", dataset)


def _summary(found: list[Splitting]) -> str:
    counts = [
        f"{sum(x.resolved and x.bits == bits for x in found)} in {bits} bits"
        for bits in sorted({x.bits for x in found if x.resolved})
    ]
    left = sum(not x.resolved for x in found)
    return ", ".join([*counts, *([f"{left} not resolved"] if left else [])])


def describe(config: Config) -> list[Row]:
    """What a config asks for, with what follows from it: for people, units named."""
    problem = config.problem
    return [
        *(
            _body_row(name, shape.heavy(problem.mu[0]), problem)
            for name, shape in problem.bodies.items()
        ),
        Row("h0", str(problem.h0), "energy of the orbits"),
        Row("mu", ", ".join(map(str, problem.mu)), "weight times distance"),
        Row("drawn", problem.drawn, f"body whose distance is kept at {problem.phases} phases"),
    ]


def _body_row(name: str, body: Body, problem: Problem) -> Row:
    unit = float(amplitude(section.surface(body, problem.h0, 53))) / float(body.mu)
    said = f"nu = {body.nu:.3f}, distance = {unit:.4g} mu cos g"
    return Row(f"body {name}", said, f"1, rad, by Melnikov; A = ({', '.join(map(str, body.A))})")


def differences(stored: Data, fresh: Data) -> list[compare.Difference]:
    """Where two results of the same config disagree by more than their arithmetic explains.

    What is resolved may differ by the errors that belong to it, what follows from it as well.

    Parameters
    ----------
    stored, fresh : dict
        ``/data`` of the two files, loaded.
    """
    found = compare.keys(stored, fresh)
    for key in ("mu_over_h0", "closed_form"):
        found += compare.differences(stored[key], fresh[key], ROUNDING, key)
    coarsest = MARGIN * TOP * COARSEST
    found += compare.differences(stored["curve"], fresh["curve"], coarsest, "curve")
    old, new = stored["bodies"], fresh["bodies"]
    if np.shape(old["error"]) != np.shape(new["error"]):
        return found + compare.arrays("bodies/error", old["error"], new["error"])
    allowed = _allowed(old, new)
    for key in ("name", *OF_BODY):
        found += compare.arrays(f"bodies/{key}", old[key], new[key], allowed.get(key, 0.0))
    return found


def _allowed(stored: Data, fresh: Data) -> dict[str, Any]:
    """By how much fields may differ; infinite for what is not resolved, or how it was found."""
    error = MARGIN * np.maximum(stored["error"], fresh["error"])
    error = np.where(fresh["resolved"], error, np.inf)
    first = np.abs(fresh["excess"][..., 0])
    # Of a slope: what the error does to the logarithms it is fitted to.
    slope = np.where(np.isfinite(error), error / first, 0.0).max(axis=1) + ROUNDING
    rounding = {key: ROUNDING * np.abs(fresh[key]) for key in ("nu", "amplitude", "largest")}
    return {
        **dict.fromkeys(("error", "bits", "orbits"), np.inf),
        **dict.fromkeys(("alpha0", "beta0"), ROUNDING),
        "nu": rounding["nu"],
        "amplitude": rounding["amplitude"],
        "slope_amplitude": slope,
        "slope_curve": slope,
        "largest": TOP * error * fresh["amplitude"] + np.nan_to_num(rounding["largest"]),
        "reduced": error + ROUNDING,
        "curve_excess": TOP * error,
        "excess": error[..., None],
    }
