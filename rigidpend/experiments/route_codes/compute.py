"""Experiment `route_codes`: arrays of binary route codes over the initial phase (Fig. 4)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend import melnikov
from rigidpend.description import Row, body_rows
from rigidpend.experiments.contract import Means
from rigidpend.experiments.route_arrays import ROUNDING, array_differences
from rigidpend.experiments.route_codes.layout import BY_MAP, ZEROS
from rigidpend.experiments.route_layout import MEANING
from rigidpend.numbers.exact import Exact
from rigidpend.results import compare
from rigidpend.results.compare import Difference
from rigidpend.results.layout import datasets
from rigidpend.results.tree import Data, Dataset, Tree
from rigidpend.routes.codes import MANY, RouteCodes, route_codes
from rigidpend.routes.phases import Grid

if TYPE_CHECKING:
    from rigidpend.config.schema import PhaseGrid
    from rigidpend.experiments.contract import Routes
    from rigidpend.experiments.route_codes.schema import Config


SYMBOLS = 15_000
"""Number of symbols computed at a time, and kept if the run is interrupted: some 0.5 s."""
MAPPED = 65_536
"""Number of columns at a time where return maps serve."""
SLOWER = 100
"""Factor by which fewer are taken where the first precision is higher than that of doubles."""

PHASES = {"theta2_0": ROUNDING, "melnikov_zeros": ROUNDING}


def compute(config: Config, means: Means) -> Tree:
    """Compute every array of a config.

    Parameters
    ----------
    config : Config
    means : Means

    Returns
    -------
    Tree
        A group for each array, with the fields of `RouteCodes` and the Melnikov zeros.
    """
    problem = config.problem
    told = ZEROS.dataset(np.array(melnikov.zeros(problem.routes)))
    groups: dict[str, Tree] = {}
    for name, grid in problem.arrays.items():
        routes = _in_parts(name, grid.phases, config, means)
        means.report(f"{name}: {_summary(routes)}")
        groups[name] = {**_group(routes), "melnikov_zeros": told}
    return groups


def _in_parts(name: str, phases: Grid, config: Config, means: Means) -> RouteCodes:
    """Compute the routes of all phases in parts of some seconds at most."""
    found = []
    slower = SLOWER if means.arithmetic.precisions[0] > 53 else 1
    at_once = max(1, SYMBOLS // (slower * config.problem.n_symbols))
    if slower == 1 and len(phases) >= MANY:
        at_once = max(at_once, MAPPED)
    for first in range(0, len(phases), at_once):
        columns = [phases[k] for k in range(first, min(first + at_once, len(phases)))]
        if len(phases) > at_once:
            means.report(f"{name}: columns from {first} of {len(phases)}")
        part = partial(_part, columns, config, means)
        tree: Any = means.part(f"{name}.{first:08d}", part)
        fields = {field: tree[field].values for field in MEANING}
        by_map = tree["by_map"].values if "by_map" in tree else np.zeros(len(columns), dtype=bool)
        found.append(RouteCodes(**fields, by_map=by_map))
    return RouteCodes(*(np.concatenate(x, axis=-1) for x in zip(*found, strict=True)))


def _part(phases: Sequence[Exact], config: Config, means: Means) -> Tree:
    problem = config.problem
    routes = route_codes(
        problem.body,
        phases,
        h0=problem.h0,
        J1_0=problem.J1_0,
        n_symbols=problem.n_symbols,
        jobs=means.jobs,
        **means.arithmetic._asdict(),
    )
    return _group(routes)


def orbits(config: Config, stored: Callable[[], Data]) -> Routes:
    """The orbits of each array."""
    problem = config.problem
    return {name: (problem.routes, grid.phases) for name, grid in problem.arrays.items()}


def describe(config: Config) -> list[Row]:
    """Describe a config in rows, with what follows from it, units named."""
    problem = config.problem
    body, checked = problem.body, problem.routes
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


def differences(stored: Data, fresh: Data) -> list[Difference]:
    """Find where two results of a config disagree by more than their arithmetic explains.

    Symbols and separatrices must be the same where both are certain. Which precision decided
    a column hangs on the last bit and is not compared, nor whether maps did.

    Parameters
    ----------
    stored, fresh : dict
        ``/data`` of the two files, loaded.
    """
    found = compare.keys(stored, fresh)
    for name in [name for name in stored if name in fresh]:
        old, new = (
            {key: x for key, x in side[name].items() if key != "by_map"} for side in (stored, fresh)
        )
        found += compare.inside(name, array_differences(old, new, PHASES))
    return found


def _array_row(name: str, grid: PhaseGrid) -> Row:
    return Row(f"array {name}", f"{grid.start} + k {grid.step}, k < {grid.count}", "rad, theta2_0")


def _group(routes: RouteCodes) -> dict[str, Dataset]:
    """The fields of an array; what maps decided is told where there was a choice."""
    fields = {**MEANING, "by_map": BY_MAP} if routes.by_map.any() else MEANING
    return datasets(fields, routes._asdict())


def _summary(routes: RouteCodes) -> str:
    n, uncertain = routes.bits.size, int((~routes.certain).sum())
    maps = int(routes.by_map.sum())
    counts = ", ".join(
        f"{int((routes.bits == bits).sum())} in {bits} bits" for bits in np.unique(routes.bits)
    )
    doubt = f"; {uncertain} symbols uncertain" if uncertain else ""
    by_map = f", {maps} by return maps" if maps else ""
    return f"{n} orbits, {counts}{by_map}{doubt}"
