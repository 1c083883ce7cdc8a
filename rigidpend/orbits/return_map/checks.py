"""Checks of a finished map at held-out points, which are nodes of no table."""

from typing import Any, NamedTuple

import numpy as np

from rigidpend.orbits.precision import Precision
from rigidpend.orbits.return_map.charts import Arcs, Chart, Charts, invariants, section_chart
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.tables import ChartTable, Looked

LEVELS = 16
"""Number of random energies at which tables are checked, one in each equal part of the interval.

Several points with an energy in common take little more time than one of them."""
ARCS, LOOK_UPS = 4, 16
"""Numbers of random points at each of these energies: of a chart, and of an inverse chart.

Points of an inverse chart need no arcs. It may err most far from the ends of the table, for a few
energies and phases: of 4,000 random points one in 100 showed half of the largest error."""
CORNERS = 16
"""Number of phases at each of the four ends of a table's width and energies.

There all terms left out add up: with bodies drawn by lot charts err by up to 90 times as much there
as at 12 random points."""
CHART_FACTOR = 16
"""Factor of the stated error of a chart over the largest difference at held-out points.

Tables and held-out arcs share a normal form, and its error. With 53 bodies drawn by lot, 400 points
each, errors by a normal form of more terms were up to 8.3 times the difference; of maps of one
energy, whose tables add little to it, they were up to 14.4 times, with 114 bodies."""
INVERSE_FACTOR = 4
"""Factor of the stated error of an inverse chart over the largest one at held-out points.

With 76 bodies drawn by lot, 400 points each, errors between these were up to 2.6 times as large."""
LONGER = 1.05
"""Factor on the duration of arcs at held-out points, over those behind the tables."""


class Errors(NamedTuple):
    """Measured errors of a map, relative to the largest value of each table."""

    exponents: float
    """Difference between the two determinations of Lambda."""
    floquet: float
    """Difference between Lambda_0 and the Floquet exponent, which is found in doubles."""
    charts: float
    """Error of charts at held-out points, by arcs of another duration."""
    inverse: float
    """Error of invariants and times after an inverse chart and a chart."""
    tail_x: float
    """Largest of the last coefficients of the tables in d and I."""
    tail_phase: float
    """Largest of the last coefficients of the tables in chi and s."""
    tail_energy: float
    """Largest of the last coefficients of the tables in h."""

    @property
    def largest(self) -> float:
        """The largest error that is measured in the precision of the tables."""
        return max(self.exponents, self.charts, self.inverse)


def measured(charts: Charts, nf: NormalForm, arcs: Arcs, exponent: float, a: Precision) -> Errors:
    """The errors of charts and of their normal form; `exponent` is that of Floquet, in doubles."""
    of_charts, of_inverses = zip(
        *(held_out(rising, charts[rising], nf, arcs, a) for rising in (False, True)), strict=True
    )
    cut = (tails(table) for chart in charts for table in chart)
    middle = float(nf.energies.basis(nf.energies.centre, a) @ nf.exponent[:, 0])
    return Errors(
        nf.disagreement,
        abs(middle - exponent),
        max(of_charts),
        max(of_inverses),
        *(max(tail) for tail in zip(*cut, strict=True)),
    )


def held_out(
    rising: bool, chart: Chart, nf: NormalForm, arcs: Arcs, a: Precision
) -> tuple[float, float]:
    """The stated errors of a chart and of its inverse, from held-out points, relative.

    The charts' own points are the ends of `arcs`; those held out are the ends of longer ones.
    """
    # The seed is fixed: a map is refused or not by what it follows from alone.
    random = np.random.default_rng(rising)
    energy = (np.arange(LEVELS) + random.uniform(0, 1, LEVELS)) * 2 / LEVELS - 1
    energy = a.array(np.append(energy, [1, -1]))
    levels = nf.energies.centre + nf.energies.half_width * energy
    share, turn, counts = points(random, ARCS)
    d, chi = chart.forward.width * a.array(share), a.array(turn) * a.pi
    form = TorusForm(nf, levels, a, counts)
    longer = arcs._replace(length=arcs.length * a.number(LONGER))
    direct = section_chart(rising, d, chi, form, longer)
    seen = chart.forward.at(form).look_up(d, chi, a)
    scale = np.array([a.largest(x) or 1.0 for x in direct])[:, None]
    # An inverse chart and then a chart give back the invariants and the constants of time.
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
    return CHART_FACTOR * a.largest((seen - direct) / scale), INVERSE_FACTOR * max(off)


def points(random: np.random.Generator, each: int) -> tuple[Any, Any, list[int]]:
    """Points of a table: shares of its width, phases in half turns, and their number by energy.

    Those at the two ends of the energies, the last two, are `CORNERS` phases at either end of the
    width.
    """
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
