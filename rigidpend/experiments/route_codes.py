"""Experiment `route_codes`: arrays of binary route codes over the initial phase (Fig. 4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from rigidpend import compare, melnikov
from rigidpend.compare import Difference
from rigidpend.exact import Exact
from rigidpend.experiments import Means, Row
from rigidpend.experiments.rows import body_rows
from rigidpend.routes import certainty
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.phases import Grid
from rigidpend.routes.problem import RouteProblem
from rigidpend.tree import Dataset, Tree

ROUNDING = 1e-14
"""By how much phases may differ, in radians, where only their rounding can."""
FIRST, SECOND, GROWTH = 1e-12, 1e-8, 3.5
"""By how much times of the first crossing and of the second may differ, and how that grows."""
APART = 20 * certainty.AGREEMENT
"""By how much times of certain crossings may differ: each errs by ten times its threshold."""

SYMBOLS = 15_000
"""How many symbols are computed at a time, and kept if the run is interrupted: some 0.5 s."""
SLOWER = 100
"""How many times fewer where the first precision is higher than that of doubles."""

MEANING = {
    "theta2_0": ("rad", "initial phase of each column"),
    "codes": ("1", "symbols, row 0 = symbol 1: 0 left, 1 right, 255 none (no return)"),
    "certain": ("1", "whether two independent computations establish the symbol"),
    "bits": ("bit", "precision that decided the column"),
    "crossing_time": ("t' = t s", "times of the crossings of J1 = J2/2, NaN where there is none"),
    "separatrix": ("1", "separatrix beside which the crossing lies, 1..4, 0 for none"),
}

PHASES = {"theta2_0": ROUNDING, "melnikov_zeros": ROUNDING}


def compute(config: Any, means: Means) -> Tree:
    """Compute every array of a config.

    Parameters
    ----------
    config : rigidpend.config.schema.route_codes.Config
    means : Means

    Returns
    -------
    Tree
        A group for each array, with the fields of `RouteCodes` and the Melnikov zeros.
    """
    problem = config.problem
    zeros = np.array(melnikov.zeros(_problem(problem)))
    told = Dataset(zeros, "rad", "zeros of Melnikov's integral in theta2_0")
    groups: dict[str, Tree] = {}
    for name, grid in problem.arrays.items():
        phases = Grid(grid.start, grid.step, grid.count)
        routes = _in_parts(name, phases, config, means)
        means.report(f"{name}: {_summary(routes)}")
        groups[name] = {**_group(routes), "melnikov_zeros": told}
    return groups


def _in_parts(name: str, phases: Grid, config: Any, means: Means) -> RouteCodes:
    """The routes of all phases; so many at a time that each part takes some seconds at most."""
    found = []
    slower = SLOWER if config.numerics.precisions[0] > 53 else 1
    at_once = max(1, SYMBOLS // (slower * config.problem.n_symbols))
    for first in range(0, len(phases), at_once):
        columns = [phases[k] for k in range(first, min(first + at_once, len(phases)))]
        if len(phases) > at_once:
            means.report(f"{name}: columns from {first} of {len(phases)}")
        part = partial(_part, columns, config, means)
        tree: Any = means.part(f"{name}.{first:08d}", part)
        found.append(RouteCodes(*(tree[field].values for field in RouteCodes._fields)))
    return RouteCodes(*(np.concatenate(x, axis=-1) for x in zip(*found, strict=True)))


def _part(phases: Sequence[Exact], config: Any, means: Means) -> Tree:
    problem, numerics = config.problem, config.numerics
    routes = route_codes(
        problem.body,
        phases,
        h0=problem.h0,
        J1_0=problem.J1_0,
        n_symbols=problem.n_symbols,
        engine=means.engine,
        tolerance=None if numerics.tolerance is None else float(numerics.tolerance),
        precisions=numerics.precisions,
        jobs=means.jobs,
    )
    return _group(routes)


def describe(config: Any) -> list[Row]:
    """What a config asks for, with what follows from it: for people, units named."""
    problem = config.problem
    body, checked = problem.body, _problem(problem)
    zeros = ", ".join(f"{x:.6f}" for x in melnikov.zeros(checked))
    return [
        *body_rows(body),
        Row("h0", str(problem.h0), "energy constant, kappa J2_0^2/2"),
        Row("J1_0", str(problem.J1_0), "initial action, dimensionless"),
        Row("J2_0", f"{float(checked.J2_0(53)):.16g}", "initial |M|, dimensionless"),
        Row("n_symbols", str(problem.n_symbols), "symbols on each orbit"),
        *(_array_row(name, grid) for name, grid in problem.arrays.items()),
        Row("Melnikov zeros", zeros, "rad, theta2_0 where the first symbol changes, to O(mu)"),
    ]


def differences(stored: Any, fresh: Any) -> list[Difference]:
    """Where two results of the same config disagree by more than their arithmetic explains.

    Symbols and separatrices must be the same where both are certain. Which precision decided
    a column hangs on the last bit and is not compared.

    Parameters
    ----------
    stored, fresh : dict
        ``/data`` of the two files, loaded.
    """
    found = compare.keys(stored, fresh)
    for name in [name for name in stored if name in fresh]:
        found += compare.inside(name, array_differences(stored[name], fresh[name], PHASES))
    return found


def array_differences(
    stored: Any, fresh: Any, rounding: Mapping[str, float], times: Any = None
) -> list[Difference]:
    """Where two arrays of routes differ.

    Parameters
    ----------
    stored, fresh : dict
        Groups, loaded.
    rounding : dict
        The fields that only round, with how much.
    times : float or (n_symbols + 1, 1) array, optional
        By how much crossing times may differ; by default `crossing_tolerance`.
    """
    found = compare.keys(stored, fresh)
    if found or stored["codes"].shape != fresh["codes"].shape:
        return found or compare.arrays("codes", stored["codes"], fresh["codes"])
    for field, limit in rounding.items():
        found += compare.arrays(field, stored[field], fresh[field], limit)
    # A symbol that has become certain is no loss.
    held = np.where(stored["certain"], 0.0, np.inf)
    found += compare.arrays("certain", stored["certain"], fresh["certain"], held)
    certain = stored["certain"] & fresh["certain"]
    after = np.vstack((certain[:1], certain))
    for field, mask, within in (
        ("codes", certain, 0.0),
        ("separatrix", after, 0.0),
        ("crossing_time", after, crossing_tolerance(len(after)) if times is None else times),
    ):
        allowed = np.where(mask, within, np.inf)
        found += compare.arrays(field, stored[field], fresh[field], allowed)
    return found


def crossing_tolerance(crossings: int, growth: float = GROWTH) -> Any:
    """By how much the times of each of so many crossings may differ: (crossings, 1), t'.

    Notes
    -----
    On the way to the first crossing an error stays relative. On a passage at a distance d it
    grows by 1/d, as exp(u T/2) with the time T that the passage takes, and T by its logarithm.
    Between scalar and batched, full and compact builds the largest difference of 4,000 random
    phases (body of Fig. 4) was 4e-15 at the first crossing, 2e-11 at the second, and then grew
    by 3.4 a crossing, to 5e-4 at the sixteenth; DOP853 is ten times as far off. More than
    `APART` no certain symbol leaves room for.
    """
    grown = np.minimum(SECOND * growth ** np.arange(crossings - 1.0), APART)
    return np.concatenate(([FIRST], grown))[:, None]


def _problem(problem: Any) -> RouteProblem:
    return RouteProblem(problem.body, problem.h0, problem.J1_0, problem.n_symbols)


def _array_row(name: str, grid: Any) -> Row:
    return Row(f"array {name}", f"{grid.start} + k {grid.step}, k < {grid.count}", "rad, theta2_0")


def _group(routes: RouteCodes) -> dict[str, Dataset]:
    return {name: Dataset(getattr(routes, name), *MEANING[name]) for name in MEANING}


def _summary(routes: RouteCodes) -> str:
    n, uncertain = routes.bits.size, int((~routes.certain).sum())
    counts = ", ".join(
        f"{int((routes.bits == bits).sum())} in {bits} bits" for bits in np.unique(routes.bits)
    )
    doubt = f"; {uncertain} symbols uncertain" if uncertain else ""
    return f"{n} orbits, {counts}{doubt}"
