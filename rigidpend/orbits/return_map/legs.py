"""Legs of orbits: from one crossing of M3 = 0 to the next, by the significant terms of tables.

A table over (x, phase, energy) holds the product of its orders; but its terms shrink with the
sum of these, so that most lie below rounding. What is left is summed as it stands: some 80 of
640 terms a function with the body of Fig. 4.

Units are such that d and I go from -1 to 1 and that W is near 1; signs such that all legs are
alike: what follows a downward crossing is run backward and mirrored, and so is the way from a
start. Phases are kept sharper than in `passage`: ln|W|/Lambda is tens of radians, of which all
but ln|W/scale|/Lambda is a smooth function of I and h, reduced by whole turns before it is
rounded.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.orbits.integrate.pair_arrays import PairArray
from rigidpend.orbits.return_map.charts import Charts, ChartTable
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.precision import Precision
from rigidpend.orbits.return_map.rates import rates_at
from rigidpend.orbits.return_map.starts import Entry

FUNCTIONS = 3
"""Functions of a chart that codes and times follow from: all but that of theta3."""


class Leg(NamedTuple):
    """From one crossing to the next: into the normal form and out of it.

    Tables are (energies, n_x, n_phase, 3) coefficients, 0 where a term is left out.
    """

    into: Any
    """W, the other and the time, over d (or the place of a start) and a phase."""
    out: Any
    """d, chi - s and the time, over I and s."""
    rates: Any
    """(energies, K, 3): coefficients of I in 1/Lambda, the rest of the depth, and dt'/dpsi."""
    largest: float
    """Largest |W|."""
    turns: float
    """Whole turns that depths are short of."""


def legs(
    nf: NormalForm, charts: Charts, starts: Entry, threshold: float, a: Precision
) -> tuple[Leg, Leg, Leg]:
    """From the starts, and past the upper orbit from upward and from downward crossings.

    Terms of tables below `threshold` are left out.
    """
    up, down = (_passage(rising, nf, charts, threshold, a) for rising in (True, False))
    reach = charts[True].inverse.width
    rates = rates_at(nf, float(starts.centre + starts.half_width), float(reach), threshold, a)
    start = Leg(
        _scaled(significant(starts.table, threshold), (1 / rates.scale, rates.scale / reach, 1)),
        down.out,
        rates.joined(-1, reach),
        nf.radius / rates.scale,
        -rates.turns,
    )
    return start, up, down


def _passage(rising: bool, nf: NormalForm, charts: Charts, threshold: float, a: Precision) -> Leg:
    """Past the upper orbit from upward crossings; mirrored from downward ones."""
    side, (forward, inverse) = 1 if rising else -1, charts[not rising]
    reach, into = inverse.width, significant(charts[rising].forward, threshold)
    # W is U beside upward crossings, V beside downward ones.
    into = into[..., [*((0, 1) if rising else (1, 0)), 2]]
    rates = rates_at(nf, float(np.abs(into[..., 0]).max()), float(reach), threshold, a)
    return Leg(
        _scaled(into, (1 / rates.scale, rates.scale / reach, side)),
        # d in units of the width of the table that comes next.
        _scaled(significant(inverse, threshold), (1 / forward.width, 1, side)),
        rates.joined(side, reach),
        np.inf,
        side * rates.turns,
    )


def significant(table: ChartTable, threshold: float) -> Any:
    """The terms of a table above `threshold`, relative to the largest of each function."""
    count = len(table.values)
    values = table.values.reshape(count, table.n_x, table.n_phase, -1)[..., :FUNCTIONS]
    sizes = np.abs(values.astype(float))
    sizes = sizes / np.maximum(sizes.max(axis=(0, 1, 2)), 1e-300)
    return np.where(sizes > threshold, values, 0)


def _scaled(values: Any, factors: tuple[Any, Any, Any]) -> Any:
    """A table with each function times a factor."""
    several = np.stack if isinstance(values, PairArray) else np.array
    return values * several(factors)
