"""Experiment `splitting`: the distance of S1- and S2+ on J1 = J2/2, true and by Melnikov."""

from functools import partial
from typing import Any

import numpy as np

from rigidpend.config.description import Row
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.shared import attributes, mu_over_h0, slope, stacked
from rigidpend.experiments.splitting import admitted
from rigidpend.experiments.splitting.schema import Config, Problem
from rigidpend.numbers import Array
from rigidpend.orbits.integrate.arithmetic import DEFAULT_TOLERANCE
from rigidpend.surfaces import surface_orbits
from rigidpend.surfaces.melnikov import decay
from rigidpend.surfaces.splitting import (
    FEWEST,
    SURE,
    WORST,
    SurfaceSplitting,
    amplitude,
    distance,
    measure,
)

BEGIN, ORBIT, FURTHER, ORBITS = 0.2, {53: 2e-4, 106: 3.5e-3}, 0.1, 1200
"""Seconds of any run, seconds of an orbit by its bits and with more, orbits per mu/h0.

The shipped config took 5.7 s of a core, half of it in pairs of doubles. An orbit in 160 bits took
0.03 to 0.1 s, at nu of 62 and 185; beyond doubles some nu orbits more are needed."""
GRID = np.linspace(-np.pi, np.pi, 721)
"""Phases at which the search for the largest distance begins, radians."""
PARABOLAS = GRID[1] - GRID[0], 1e-4
"""Half-widths of the parabolas through three distances, each with its vertex as the next phase.

The error of the phase falls like a square of the width: after the second, rounding dominates."""


def compute(config: Config, means: Means) -> Tree:
    """Measure the splitting of every body at every mu."""
    problem = config.problem
    found = {name: means.part(name, partial(_body, config, name, means)) for name in problem.bodies}
    bodies = stacked(found)
    nu = np.linspace(0.5, np.ceil(bodies["nu"].max() + 1), 100)
    return {
        "mu_over_h0": mu_over_h0(problem),
        "bodies": bodies,
        "curve": _curve(problem, found[problem.drawn]),
        "closed_form": {"nu": nu, "decay": decay(nu)},
    }


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes on two cores.

    Numbers resolve a distance as long as their rounding is below the admitted error; a large nu
    makes the distance small beside it. A larger weight takes more orbits for a curve. What the
    first precision does not resolve is tried in each further one that may (`measure`).
    """
    problem, ratio = config.problem, mu_over_h0(config.problem)
    orbits = FEWEST + ORBITS * ratio
    first, seconds = config.numerics.precisions[0], BEGIN
    for shape in problem.bodies.values():
        nu, open_ = shape.body.nu, ratio > 0
        least = decay(nu) * admitted(ratio)
        for bits in config.numerics.precisions:
            noise = DEFAULT_TOLERANCE["taylor"] * 2.0 ** (53 - bits)
            tried = open_ & ((noise <= WORST * least) | (bits == first))
            # Doubles double the number as long as nothing is told.
            taken = orbits + nu if bits > 53 else np.where(noise < least, orbits, 2 * SURE)
            seconds += float(taken[tried].sum()) * ORBIT.get(bits, FURTHER)
            open_ &= noise >= least
    return seconds


def _body(config: Config, name: str, means: Means) -> Tree:
    """Compute the fields of one body."""
    problem = config.problem
    bodies, ratio = [problem.bodies[name].heavy(mu) for mu in problem.mu], mu_over_h0(problem)
    found = [
        measure(body, problem.h0, float(most), means.arithmetic, means.jobs)
        for body, most in zip(bodies, admitted(ratio), strict=True)
    ]
    body = bodies[0]
    told = attributes(("error", "resolved", "bits", "amplitude", "excess"), found)
    excess, amplitudes = told["excess"], told["amplitude"]
    # Melnikov's own distance, cos g in its amplitude, is added back to the excess.
    whole = excess + np.eye(1, excess.shape[1])
    curve_excess = largest(excess)
    means.report(f"{name}: nu = {body.nu:.2f}, {_summary(found)}")
    return {
        **{key: getattr(body, key) for key in ("alpha0", "beta0", "nu")},
        **told,
        "orbits": np.array([x.n for x in found]),
        "reduced": whole[:, 0] * decay(body.nu),
        "largest": amplitudes * largest(whole),
        "curve_excess": curve_excess,
        "slope_amplitude": slope(ratio, np.abs(excess[:, 0])),
        "slope_curve": slope(ratio, curve_excess),
    }


def largest(harmonics: Array) -> Array:
    """Largest |distance| over all phases, for harmonics (n, k)."""
    return np.array([_peak(row) for row in harmonics])


def _peak(harmonics: Array) -> float:
    """Largest |distance|, at one of the phases where its slope vanishes."""
    g = GRID
    for h in PARABOLAS:
        before, here, after = (distance(harmonics, g + off) for off in (-h, 0, h))
        slope, bend = (after - before) / 2, after - 2 * here + before
        # The vertex is h slope/bend away; where that is more than h there is no extremum nearby.
        near = np.abs(bend) > np.abs(slope)
        g = g - h * np.divide(slope, bend, out=np.zeros_like(g), where=near)
    return float(np.abs(distance(harmonics, g)).max())


def _curve(problem: Problem, body: Any) -> dict[str, Any]:
    g = np.linspace(-np.pi, np.pi, problem.phases)
    excess = np.where(body["resolved"][:, None], body["excess"], np.nan)
    measured = np.stack([np.cos(g) + distance(row, g) for row in excess])
    return {"body": problem.drawn, "g": g, "melnikov": np.cos(g), "measured": measured}


def _summary(found: list[SurfaceSplitting]) -> str:
    counts = [
        f"{sum(x.resolved and x.bits == bits for x in found)} in {bits} bits"
        for bits in sorted({x.bits for x in found if x.resolved})
    ]
    left = sum(not x.resolved for x in found)
    return ", ".join([*counts, *([f"{left} not resolved"] if left else [])])


def describe(config: Config) -> list[Row]:
    """Rows with the distance of each body by Melnikov's integral."""
    problem, rows = config.problem, []
    for name, shape in problem.bodies.items():
        body = shape.heavy(problem.mu[0])
        surface = surface_orbits.surface(body, problem.h0, 53)
        # Not as a double, because the amplitude of a large nu is below all doubles.
        unit = surface_orbits.numbers(53).nstr(amplitude(surface) / surface.p.mu, 4)
        said = f"nu = {body.nu:.3f}, distance = {unit} mu cos g"
        meaning = f"1, rad, by Melnikov; A = ({', '.join(map(str, body.A))})"
        rows.append(Row(f"body {name}", said, meaning))
    return rows
