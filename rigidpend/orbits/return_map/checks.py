"""Checks of a finished map at points that no table has seen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map.charts import (
    Chart,
    ChartTable,
    kept,
    section_chart,
)
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.precision import Precision
from rigidpend.orbits.return_map.reduced import Coefficients

POINTS = 64
"""Points by lot at which a chart is checked, and as many at the four ends.

At the ends of its width and of its energies all that expansions leave out adds up: with bodies
drawn by lot charts err by up to 90 times as much there as at 12 points by lot. Inverse charts may
err most between them: beside 16 points by lot one erred by 2.8 times what it stated."""
ABREAST = 4
"""Points by lot with an energy in common."""
SHARED = 5
"""Factor by which charts err more than beside arcs that end in the same normal form.

With 10 bodies drawn by lot, 400 points each, they do by up to 4.2, beside one of more terms."""
BETWEEN = 3
"""Factor by which inverse charts err more between the points at which they are checked.

With 72 bodies drawn by lot, 400 points each, they do by up to 2.1."""
LONGER = 1.05
"""Excess length of the arcs of the held-out points over those behind the tables."""


class Errors(NamedTuple):
    """Measured errors of a map, relative to the largest value of each table."""

    exponents: float
    """Between the two determinations of Lambda."""
    floquet: float
    """Between Lambda_0 and the Floquet exponent of the periodic orbit found in doubles."""
    charts: float
    """At held-out points, by arcs of another length."""
    inverse: float
    """Errors of the invariants and the times, after an inverse chart and a chart."""
    tail_x: float
    """The last coefficients of the tables in d and I."""
    tail_phase: float
    """Tail of the tables in chi and s."""
    tail_energy: float
    """Tail of the tables in h."""

    @property
    def largest(self) -> float:
        """The largest of those that are measured in the precision of the tables."""
        return max(self.exponents, self.charts, self.inverse)


def held_out(
    rising: bool,
    chart: Chart[ChartTable],
    nf: NormalForm,
    c: Coefficients,
    length: Scalar,
    a: Precision,
) -> tuple[float, float]:
    """The errors of a chart and of its inverse at points that no table has seen."""
    random, ends, phases = np.random.default_rng(rising), [1, -1], POINTS // 4
    share, turn = random.uniform(-1, 1, (2, 2 * POINTS))
    share[POINTS:] = np.tile(ends, POINTS // 2)
    turn[POINTS:] = np.tile(np.repeat(np.arange(phases) + 0.5, 2) * 2 / phases - 1, 2)
    # Points with an energy in common take little more than one of them.
    counts = [ABREAST] * (POINTS // ABREAST) + [POINTS // 2] * 2
    energy = np.append(random.uniform(-1, 1, POINTS // ABREAST), ends)
    levels = nf.energies.centre + nf.energies.half_width * a.array(energy)
    weights = nf.energies.basis(levels, a)
    chi, h, d = (
        a.array(turn) * a.pi,
        np.repeat(levels, counts),
        chart.forward.width * a.array(share),
    )
    longer = length * a.number(LONGER)
    direct = section_chart(rising, d, chi, h, weights, nf, c, longer, a, counts)
    forward, inverse = (table.at(weights, counts) for table in chart)
    seen = forward.look_up(d, chi, a)
    scale = np.array([a.largest(x) or 1.0 for x in direct])[:, None]
    I = chart.inverse.width * a.array(share)
    there = inverse.look_up(I, chi, a)
    back = forward.look_up(there[0], chi + there[1], a)
    rates = weights @ nf.exponent, weights @ nf.rotation
    again = kept(rising, back, chi + there[1], *rates, a, counts)
    off = (
        a.largest((again.I - I) / chart.inverse.width),
        a.largest(again.s - chi),
        a.largest((back[2:] - there[2:]) / scale[2:]),
    )
    return SHARED * a.largest((seen - direct) / scale), BETWEEN * max(off)


def tails(table: ChartTable) -> tuple[float, float, float]:
    """The last coefficients of a table in x, phase and energy, relative to the largest."""
    shape = (len(table.values), table.n_x, table.n_phase, 4)
    sizes = np.abs(table.values.astype(float)).reshape(shape)
    sizes = sizes / np.maximum(sizes.max(axis=(0, 1, 2)), 1e-300)
    last_energy = sizes[-1].max() if len(sizes) > 1 else 0.0
    return float(sizes[:, -1].max()), float(sizes[:, :, -2:].max()), float(last_energy)
