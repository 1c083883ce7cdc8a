"""Experiment `splitting`: the distance of S1- and S2+ on J1 = J2/2, true and by Melnikov."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.config.description import Row, exact_row
from rigidpend.experiments import weight_series
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import compare
from rigidpend.experiments.data.layout import datasets
from rigidpend.experiments.data.tree import Data, Tree
from rigidpend.experiments.splitting.layout import CLOSED_FORM, CURVE, OF_BODY
from rigidpend.experiments.weight_layout import MU_OVER_H0
from rigidpend.experiments.weight_series import mu_over_h0, plain, slope
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array
from rigidpend.orbits.integrate.engines import DEFAULT_TOLERANCE
from rigidpend.surfaces import surface_orbits
from rigidpend.surfaces.splitting import (
    COARSEST,
    FEWEST,
    TOP,
    SurfaceSplitting,
    admitted,
    amplitude,
    distance,
    measure,
)

if TYPE_CHECKING:
    from rigidpend.experiments.splitting.schema import Config, Problem

BEGIN, ORBIT, ORBITS = 1.0, (5e-4, 8e-3), 1200
"""Seconds of any run, those of an orbit in doubles or in pairs of them, orbits per mu/h0.

The configuration that is shipped took 12 s, half of it in pairs."""
RELATIVE = 1e-13
"""Allowed relative difference of numbers of closed form."""
MARGIN = 2
"""Allowed difference of two results, in units of the error that is admitted of each."""
GRID = np.linspace(-np.pi, np.pi, 721)
"""Phases among which the largest distances are looked for."""


def compute(config: Config, means: Means) -> Tree:
    """Measure the splitting of every body at every mu.

    Returns
    -------
    Tree
        `mu_over_h0`; `bodies`, with their names and `OF_BODY`; `curve`, the distance of one
        body; `closed_form`, nu/sinh(nu) along nu.
    """
    problem = config.problem
    found = weight_series.each(problem, lambda name: _body(config, name, means), means)
    return {
        "mu_over_h0": MU_OVER_H0.dataset(mu_over_h0(problem)),
        "bodies": weight_series.joined(found, OF_BODY),
        "curve": _curve(problem, found[problem.drawn]),
        "closed_form": _closed_form(max(plain(body["nu"]) for body in found.values())),
    }


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes on two cores.

    Doubles resolve a distance as long as their rounding, which a large nu makes large beside it,
    is below what is admitted. The larger the weight, the more orbits a curve takes.
    """
    problem, ratio = config.problem, mu_over_h0(config.problem)
    orbits = FEWEST + ORBITS * ratio
    seconds = BEGIN
    for shape in problem.bodies.values():
        nu = shape.heavy(problem.mu[0]).nu
        doubles = DEFAULT_TOLERANCE["taylor"] / _decay(nu) < admitted(ratio)
        seconds += float((orbits * np.where(doubles, *ORBIT)).sum())
    return seconds


def _body(config: Config, name: str, means: Means) -> Tree:
    """Compute the fields of one body."""
    problem = config.problem
    bodies = [problem.bodies[name].heavy(mu) for mu in problem.mu]
    found = [measure(body, problem.h0, means.arithmetic, means.jobs) for body in bodies]
    means.report(f"{name}: nu = {bodies[0].nu:.2f}, {_summary(found)}")
    values = _told(bodies[0], found, mu_over_h0(problem))
    return datasets(OF_BODY, values)


def _told(body: Body, found: list[SurfaceSplitting], ratio: Array) -> dict[str, Any]:
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
        "slope_amplitude": slope(ratio, np.abs(excess[:, 0])),
        "slope_curve": slope(ratio, curve_excess),
    }


def _largest(harmonics: Array) -> Array:
    """Largest |distance| over all phases, for harmonics (n, k)."""
    return np.array([np.abs(distance(row, GRID)).max() for row in harmonics])


def _decay(nu: Any) -> Any:
    """Factor nu/sinh(nu), by which Melnikov's amplitude is exponentially small."""
    return nu / np.sinh(nu)


def _curve(problem: Problem, body: Tree) -> Tree:
    g = np.linspace(-np.pi, np.pi, problem.phases)
    excess = np.where(plain(body["resolved"])[:, None], plain(body["excess"]), np.nan)
    measured = [np.cos(g) + distance(row, g) for row in excess]
    values = {
        "body": problem.drawn,
        "g": g,
        "melnikov": np.cos(g),
        "measured": np.stack(measured),
    }
    return datasets(CURVE, values)


def _closed_form(most: float) -> Tree:
    nu = np.linspace(0.5, np.ceil(most + 1), 100)
    return datasets(CLOSED_FORM, {"nu": nu, "decay": _decay(nu)})


def _summary(found: list[SurfaceSplitting]) -> str:
    counts = [
        f"{sum(x.resolved and x.bits == bits for x in found)} in {bits} bits"
        for bits in sorted({x.bits for x in found if x.resolved})
    ]
    left = sum(not x.resolved for x in found)
    return ", ".join([*counts, *([f"{left} not resolved"] if left else [])])


def describe(config: Config) -> list[Row]:
    """Describe a config in rows, with what follows from it, units named."""
    problem = config.problem
    return [
        *(
            _body_row(name, shape.heavy(problem.mu[0]), problem)
            for name, shape in problem.bodies.items()
        ),
        exact_row("h0", "energy of the orbits", problem.h0),
        exact_row("mu", "weight times distance", *problem.mu),
        Row("drawn", problem.drawn, f"body whose distance is kept at {problem.phases} phases"),
    ]


def _body_row(name: str, body: Body, problem: Problem) -> Row:
    unit = float(amplitude(surface_orbits.surface(body, problem.h0, 53))) / float(body.mu)
    said = f"nu = {body.nu:.3f}, distance = {unit:.4g} mu cos g"
    return Row(f"body {name}", said, f"1, rad, by Melnikov; A = ({', '.join(map(str, body.A))})")


def differences(stored: Data, fresh: Data) -> list[compare.Difference]:
    """Find where two results of a config disagree by more than their arithmetic explains.

    What is resolved may differ by the errors that are admitted of it, what follows from it as
    well. Those that the fresh result states open nothing: they must be as small as admitted.
    """
    found = compare.keys(stored, fresh)
    for key in ("mu_over_h0", "closed_form"):
        found += compare.differences(stored[key], fresh[key], RELATIVE, key)
    coarsest = MARGIN * TOP * COARSEST
    found += compare.differences(stored["curve"], fresh["curve"], coarsest, "curve")
    old, new = stored["bodies"], fresh["bodies"]
    if np.shape(old["error"]) != np.shape(new["error"]):
        return found + compare.arrays("bodies/error", old["error"], new["error"])
    # Errors of what is not resolved are told, and nothing more is claimed of it.
    within = np.where(old["resolved"], admitted(stored["mu_over_h0"]), np.inf)
    found += compare.beyond("bodies/error", new["error"], within)
    allowed = _allowed(old, within)
    for key in ("name", *OF_BODY):
        found += compare.arrays(f"bodies/{key}", old[key], new[key], allowed.get(key, 0.0))
    return found


def _allowed(stored: Data, within: Array) -> dict[str, Any]:
    """Allowed difference of fields; infinite for what is not resolved, or how it was found."""
    error, first = MARGIN * within, np.abs(stored["excess"][..., 0])
    # Of a slope: what the error does to the logarithms it is fitted to.
    slope = np.where(np.isfinite(error), error / first, 0.0).max(axis=1) + RELATIVE
    rounding = {key: RELATIVE * np.abs(stored[key]) for key in ("nu", "amplitude", "largest")}
    return {
        **dict.fromkeys(("error", "bits", "orbits"), np.inf),
        **dict.fromkeys(("alpha0", "beta0"), RELATIVE),
        "nu": rounding["nu"],
        "amplitude": rounding["amplitude"],
        "slope_amplitude": slope,
        "slope_curve": slope,
        "largest": TOP * error * stored["amplitude"] + np.nan_to_num(rounding["largest"]),
        "reduced": error + RELATIVE,
        "curve_excess": TOP * error,
        "excess": error[..., None],
    }
