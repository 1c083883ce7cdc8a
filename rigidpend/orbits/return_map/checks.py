"""Checks of a finished map at points that no table has seen."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map.charts import Chart, ChartTable, Looked, invariants, section_chart
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.precision import Precision
from rigidpend.orbits.return_map.reduced import Coefficients

LEVELS = 16
"""Energies by lot at which tables are checked, one in each of as many equal parts of the interval.

Points with an energy in common take little more than one of them."""
ARCS, LOOK_UPS = 4, 16
"""Points by lot at each of these: of a chart, and of an inverse chart, which takes no arcs.

Inverse charts may err most between the ends, for a few energies and phases: of 4,000 points by
lot one in 100 showed half of the largest error."""
CORNERS = 16
"""Phases at the four ends of a table's width and energies, where all that is left out adds up.

With bodies drawn by lot charts err by up to 90 times as much there as at 12 points by lot."""
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
    chart: Chart,
    nf: NormalForm,
    c: Coefficients,
    length: Scalar,
    a: Precision,
) -> tuple[float, float]:
    """The errors of a chart and of its inverse at points that no table has seen."""
    random = np.random.default_rng(rising)
    energy = (np.arange(LEVELS) + random.uniform(0, 1, LEVELS)) * 2 / LEVELS - 1
    energy = a.array(np.append(energy, [1, -1]))
    levels = nf.energies.centre + nf.energies.half_width * energy
    share, turn, counts = points(random, ARCS)
    d, chi = chart.forward.width * a.array(share), a.array(turn) * a.pi
    form = TorusForm(nf, levels, a, counts)
    direct = section_chart(rising, d, chi, form, c, length * a.number(LONGER))
    seen = chart.forward.at(form).look_up(d, chi, a)
    scale = np.array([a.largest(x) or 1.0 for x in direct])[:, None]
    share, turn, counts = points(random, LOOK_UPS)
    I, s = chart.inverse.width * a.array(share), a.array(turn) * a.pi
    form = TorusForm(nf, levels, a, counts)
    forward, inverse = chart.at(form)
    there = inverse.look_up(I, s, a)
    back = forward.look_up(there[0], s + there[1], a)
    again = invariants(rising, Looked(back), s + there[1], form)
    off = (
        a.largest((again.I - I) / chart.inverse.width),
        a.largest(again.s - s),
        a.largest((back[2:] - there[2:]) / scale[2:]),
    )
    return SHARED * a.largest((seen - direct) / scale), BETWEEN * max(off)


def points(random: np.random.Generator, each: int) -> tuple[Any, Any, list[int]]:
    """Points of a table: shares of its width, half turns, and how many at each energy."""
    share, turn = random.uniform(-1, 1, (2, LEVELS * each))
    ends, phases = np.tile([1, -1], CORNERS), (np.arange(CORNERS) + 0.5) * 2 / CORNERS - 1
    share, turn = np.append(share, [ends, ends]), np.append(turn, [np.repeat(phases, 2)] * 2)
    return share, turn, [each] * LEVELS + [2 * CORNERS] * 2


def tails(table: ChartTable) -> tuple[float, float, float]:
    """The last coefficients of a table in x, phase and energy, relative to the largest."""
    shape = (len(table.values), table.n_x, table.n_phase, -1)
    sizes = np.abs(table.values.astype(float)).reshape(shape)
    sizes = sizes / np.maximum(sizes.max(axis=(0, 1, 2)), 1e-300)
    last_energy = sizes[-1].max() if len(sizes) > 1 else 0.0
    return float(sizes[:, -1].max()), float(sizes[:, :, -2:].max()), float(last_energy)
