"""Experiment `route_codes`: arrays of binary route codes over the initial phase (Fig. 4)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from rigidpend import melnikov
from rigidpend.experiments import Means, Row
from rigidpend.experiments.rows import body_rows
from rigidpend.routes.certainty import LINEAR
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.phases import Grid
from rigidpend.routes.problem import RouteProblem
from rigidpend.tree import Dataset, Tree

ROUNDING = 1e-14
"""By how much phases may differ, in radians, where only their rounding can."""

MEANING = {
    "theta2_0": ("rad", "initial phase of each column"),
    "codes": ("1", "symbols, row 0 = symbol 1: 0 left, 1 right, 255 none (no return)"),
    "certain": ("1", "whether two independent computations establish the symbol"),
    "bits": ("bit", "precision that decided the column"),
    "crossing_time": ("t' = t s", "times of the crossings of J1 = J2/2, NaN where there is none"),
    "separatrix": ("1", "separatrix beside which the crossing lies, 1..4, 0 for none"),
}

ROUTES = ("codes", "certain", "bits", "crossing_time", "separatrix")
PHASES = ("theta2_0", "melnikov_zeros")


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
    problem, numerics = config.problem, config.numerics
    tolerance = None if numerics.tolerance is None else float(numerics.tolerance)
    zeros = melnikov.zeros(_problem(problem))
    groups: dict[str, Tree] = {}
    for name, grid in problem.arrays.items():
        routes = route_codes(
            problem.body,
            Grid(grid.start, grid.step, grid.count),
            h0=problem.h0,
            J1_0=problem.J1_0,
            n_symbols=problem.n_symbols,
            engine=means.engine,
            tolerance=tolerance,
            precisions=numerics.precisions,
            jobs=means.jobs,
        )
        means.report(f"{name}: {_summary(routes)}")
        groups[name] = _group(routes, zeros)
    return groups


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


def differences(stored: Any, fresh: Any) -> list[str]:
    """Where two results of the same config disagree by more than their arithmetic explains.

    Symbols and separatrices must be the same where both are certain. Crossing times may differ
    by as much as two computations that establish the same symbols: see `certainty.LINEAR`.

    Parameters
    ----------
    stored, fresh : dict
        ``/data`` of the two files, loaded.
    """
    found = [f"array {name} is in one file only" for name in sorted(set(stored) ^ set(fresh))]
    for name in sorted(set(stored) & set(fresh)):
        found += [
            f"{name}: {text}" for text in array_differences(stored[name], fresh[name], PHASES)
        ]
    return found


def array_differences(stored: Any, fresh: Any, phases: tuple[str, ...]) -> Iterator[str]:
    """Where two arrays of routes differ; `phases` are the fields that only round."""
    needed = (*ROUTES, *phases)
    absent = [field for field in needed if field not in stored or field not in fresh]
    if absent:
        yield f"{', '.join(absent)} is in one file only"
        return
    if stored["codes"].shape != fresh["codes"].shape:
        yield f"{stored['codes'].shape} symbols stored, {fresh['codes'].shape} computed"
        return
    lost = stored["certain"][:] & ~fresh["certain"][:]
    if lost.any():
        yield f"{lost.sum()} symbols are no longer certain"
    for field in phases:
        yield from _far(field, stored[field][:], fresh[field][:], ROUNDING)
    certain = stored["certain"][:] & fresh["certain"][:]
    after = np.vstack((certain[:1], certain))
    for field, mask in (("codes", certain), ("separatrix", after)):
        wrong = mask & (stored[field][:] != fresh[field][:])
        if wrong.any():
            row, column = np.argwhere(wrong)[0]
            yield f"{field} differ in {wrong.sum()} cells, first [{row}, {column}]"
    old, new = (np.where(after, group["crossing_time"][:], 0.0) for group in (stored, fresh))
    yield from _far("crossing_time", old, new, LINEAR)


def _far(field: str, stored: Any, fresh: Any, allowed: float) -> Iterator[str]:
    """Whether values differ by more than is allowed, with the worst of them."""
    gap = np.where(np.isnan(stored) & np.isnan(fresh), 0.0, np.abs(stored - fresh))
    gap = np.where(np.isnan(gap), np.inf, gap)
    if (gap > allowed).any():
        worst = np.unravel_index(np.argmax(gap), gap.shape)
        at = ", ".join(map(str, worst))
        yield f"{field}[{at}]: stored {stored[worst]:.17g}, computed {fresh[worst]:.17g}"


def _problem(problem: Any) -> RouteProblem:
    return RouteProblem(problem.body, problem.h0, problem.J1_0, problem.n_symbols)


def _array_row(name: str, grid: Any) -> Row:
    return Row(f"array {name}", f"{grid.start} + k {grid.step}, k < {grid.count}", "rad, theta2_0")


def _group(routes: RouteCodes, zeros: tuple[float, ...]) -> Tree:
    fields = {name: Dataset(getattr(routes, name), *MEANING[name]) for name in MEANING}
    melnikov_zeros = Dataset(np.array(zeros), "rad", "zeros of Melnikov's integral in theta2_0")
    return {**fields, "melnikov_zeros": melnikov_zeros}


def _summary(routes: RouteCodes) -> str:
    n, uncertain = routes.bits.size, int((~routes.certain).sum())
    counts = ", ".join(
        f"{int((routes.bits == bits).sum())} in {bits} bits" for bits in np.unique(routes.bits)
    )
    doubt = f"; {uncertain} symbols uncertain" if uncertain else ""
    return f"{n} orbits, {counts}{doubt}"
