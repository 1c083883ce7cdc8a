"""The true errors of return maps over those that they state, on bodies drawn by lot.

The truth is a chart by a normal form of more terms at arcs of another length, in pairs of doubles:
it errs by some 2^-90, where maps of 64 bits err by 2^-65. Run as
``python -m scripts.stated_maps [BODIES]``.
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from rigidpend.experiments.bench.problems import drawn
from rigidpend.orbits.precision import MOST_IN_TRIPLES, in_triples, precision
from rigidpend.orbits.return_map import MapError, ReturnMap, return_map
from rigidpend.orbits.return_map.build import FIRST
from rigidpend.orbits.return_map.charts import Arcs, invariants, section_chart
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.normal_form import normal_form
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.orbits.return_map.tables import Looked
from rigidpend.routes.problem import RouteProblem, narrower

BITS = 64
FINER = 96
"""Bits of the truth."""
POINTS = 200
"""Points of each chart, one in each of as many equal parts of its width, energies by lot."""
SHORTER = 0.97
"""Length of the arcs of the truth over those behind the tables."""
QUANTILES = 0.5, 0.9, 0.99, 1.0


def ratios(made: ReturnMap) -> tuple[Any, Any]:
    """True over stated errors of the charts and of the inverse charts, at points drawn by lot.

    The truth has more coefficients of f (`return_map.nome`), and so another invariant. That is no
    error of a map, but counts here as one.
    """
    a, o, nf = precision(FINER), made.orders, made.normal_form
    c = coefficients(made.body.angles(FINER + 32), made.design.unit, a)
    sharp = in_triples(MOST_IN_TRIPLES)
    sharper = coefficients(made.body.angles(sharp.bits + 32), made.design.unit, sharp)
    arcs = Arcs(a.number(o.length * SHORTER), sharper, sharp, made.midlines)
    energies = nf.energies._replace(n=o.n_energy + 4 if o.n_energy > 1 else 1)
    sizes = o.degree + 12, o.n_phase_orbit + 8
    finer = normal_form(c, energies, *sizes, nf.radius, a, theta3=nf.theta3)
    random, charts, inverses = np.random.default_rng(1), [], []
    for rising, chart in enumerate(made.charts):
        chi, energy = (a.array(x) for x in random.uniform(-1, 1, (2, POINTS)))
        share = a.array((np.arange(POINTS) + random.uniform(0, 1, POINTS)) * 2 / POINTS - 1)
        chi, h = chi * a.pi, energies.centre + energies.half_width * energy
        forms = TorusForm(nf, h, a), TorusForm(finer, h, a)

        def true(d: Any, chi: Any, rising: int = rising, form: TorusForm = forms[1]) -> Any:
            return section_chart(bool(rising), d, chi, form, arcs)

        forward, inverse = chart.at(forms[0])
        d = forward.width * share
        right = true(d, chi)
        scale = np.array([a.largest(x) for x in right])[:, None]
        off = np.abs(a.floats(forward.look_up(d, chi, a) - right)) / scale
        charts.append(off.max(axis=0) / made.errors.charts)
        I = inverse.width * share
        there = inverse.look_up(I, chi, a)
        back = true(there[0], chi + there[1])
        I_back, s_back, *_ = invariants(bool(rising), Looked(back), chi + there[1], forms[1])
        off = [(I_back - I) / inverse.width, s_back - chi, *((back - there)[2:] / scale[2:])]
        # An inverse chart states what it errs by beside the chart's table.
        stated = made.errors.inverse + made.errors.charts
        inverses.append(np.max([np.abs(a.floats(x)) for x in off], axis=0) / stated)
    return np.concatenate(charts), np.concatenate(inverses)


def of(problem: RouteProblem) -> tuple[Any, Any]:
    """:func:`ratios` of the map that a problem's orbits take in 64 bits."""
    design = FIRST._replace(narrower=narrower(problem))
    return ratios(return_map(problem.body, h=problem.energies, bits=BITS, design=design))


def rows(problems: list[RouteProblem]) -> Iterator[str]:
    """A line for each body: quantiles of the ratios, or why there is no map."""
    for k, problem in enumerate(problems):
        try:
            shown = (np.quantile(x, QUANTILES) for x in of(problem))
            yield f"{k:3d}  " + "   ".join(" ".join(f"{x:7.2g}" for x in each) for each in shown)
        except MapError as reason:
            yield f"{k:3d}  {reason}"


def main() -> None:
    """Print the ratios of so many bodies."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("bodies", type=int, nargs="?", help="number of bodies; all by default")
    given = parser.parse_args()
    print(
        f"true over stated errors, {BITS} bits; quantiles {QUANTILES} of charts, of inverse charts"
    )
    for line in rows(drawn()[: given.bodies]):
        print(line, flush=True)


if __name__ == "__main__":
    main()
