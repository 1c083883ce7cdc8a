"""Orders of a map's tables: the number of terms that a body, an energy and a precision need.

They follow from the two looks at the body (`looks`), before any table is made. Errors are measured
only later, on the finished tables, and call for higher orders if they are too large.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rigidpend.orbits.integrate.arithmetic import PAIRS
from rigidpend.orbits.precision import Precision
from rigidpend.orbits.return_map.charts import quadrature_points
from rigidpend.orbits.return_map.checks import Errors
from rigidpend.orbits.return_map.looks import Rough, Shrinking, least_degree, odd, terms_until
from rigidpend.orbits.return_map.midline import Layer
from rigidpend.orbits.return_map.tables import FORWARD_POWER, INVERSE_POWER, table_sizes

TOLD = 2
"""Factor up to which the error of a table may exceed its last coefficients, to be theirs."""
SUMMED = 512
"""Largest error of a chart, as it is stated, over its last coefficients.

At the ends of a table's width all coefficients left out add up."""
RAISED = 1.2
"""Factor by which orders are raised for another attempt; for the normal form it is the most."""
BY_MPMATH = 200
"""Time that numbers of mpmath take, over that of pairs: 90 to 450 for maps of Fig. 4's body."""


class Orders(NamedTuple):
    """Sizes of the tables and of the normal form, with the duration of the arcs."""

    degree: int
    """Degree of the normal form, odd."""
    n_phase_orbit: int
    """Number of phases of the normal form."""
    n_x: int
    """Number of Chebyshev nodes in d and in I."""
    n_phase: int
    """Number of phases of a chart."""
    n_phase_inverse: int
    """Number of phases of an inverse chart."""
    n_energy: int
    """Number of Chebyshev nodes in the energy."""
    length: float
    """Duration of the arcs, t'."""

    def larger(self, errors: Errors, allowed: float) -> Orders:
        """The orders for another attempt: those are raised that the errors show to be too small."""
        # A tail beyond some share of what is allowed calls for more terms in its direction.
        tails, small = (errors.tail_x, errors.tail_phase, errors.tail_energy), allowed / 8
        x, phase, energy = (RAISED if tail * SUMMED > allowed else 1.0 for tail in tails)
        told = TOLD * max(tails)
        if errors.inverse > max(told, allowed / 2):
            # The tails do not explain it. At its nodes an inverse chart is solved exactly from the
            # chart's own table, so that only its own truncation remains.
            phase = energy = RAISED
        # Each degree gains as many digits as the others: the share of digits that are missing is
        # the share of degrees to add.
        share = math.log(max(errors.charts, 2 * small) / small) / -math.log(small)
        # What tails do not explain of a chart's error comes from the normal form.
        own = errors.charts > told or x == phase == energy == 1
        inner = min(RAISED, 1 + share) if own else 1.0
        return Orders(
            odd(self.degree * inner),
            odd(self.n_phase_orbit * inner),
            math.ceil(self.n_x * x),
            odd(self.n_phase * phase),
            odd(self.n_phase_inverse * phase),
            math.ceil(self.n_energy * energy) if self.n_energy > 1 else 1,
            self.length,
        )

    def designed(self, unit: float, stretch: float, more: int) -> Orders:
        """The orders of a design, which adds `more` terms, with the arcs' duration in its unit."""
        return Orders(
            self.degree + more,
            self.n_phase_orbit + more,
            self.n_x + more // 2,
            self.n_phase + more,
            self.n_phase_inverse + more,
            self.n_energy + more // 2 if self.n_energy > 1 else 1,
            self.length / unit * stretch,
        )


def building_seconds(
    body: Rough, o: Orders, a: Precision, sharp: Precision, *, theta3: bool
) -> float:
    """Expected seconds of a core to make tables of given orders in the precision `a`, in pairs.

    Arcs are in that of `sharp`, in pairs too or in sums of three.

    For 28 maps of Fig. 4's body and six drawn by lot, whose tables took 0.06 to 2.1 s, it is 0.7 to
    1.3 times the time taken. On a machine half as fast it was 0.3 to 0.6 of it, and 0.3 to 0.9 for
    eight maps of 1.9 to 4.9 s whose arcs are in sums of three.
    """
    # Arcs with the normal form solved at their ends, points of inverse charts, and products of
    # series, in microseconds as measured; charts are made for two sections. A normal form takes
    # some time for each degree, however few numbers a series has.
    of = o.n_energy, FORWARD_POWER
    charts = sum(math.prod(x) for x in table_sizes(o.n_x, o.n_phase, *of))
    of = o.n_energy, INVERSE_POWER
    inverses = sum(math.prod(x) for x in table_sizes(o.n_x, o.n_phase_inverse, *of))
    terms = (o.degree + 1) * (o.degree + 3) / 4 * o.n_phase_orbit
    points = quadrature_points(o.length, body.c, body.h, a.bits)
    step = 10.5 + 0.34 * (sharp.bits - PAIRS) if sharp.parts == 3 else 2.4
    arc = 20 + step * o.length + 0.6 * points * theta3 + 0.0018 * terms
    back = 8 + 0.026 * o.n_x * o.n_phase_inverse
    series = 2000 * o.degree + 0.0038 * o.n_energy * o.n_phase_orbit * o.degree**3
    seconds = 0.03 + (2 * charts * arc + 2 * inverses * back + series) * 1e-6
    return seconds if a.parts else seconds * BY_MPMATH


def orders(
    body: Rough, half: float, layer: Layer, seen: Shrinking, target: float, inner: float
) -> Orders:
    """The orders at which the first terms left out are below `target`, relative to the largest.

    The normal form's own are below `inner`. `half` is half of the width of the interval of
    energies, around the energy of the looks.

    Raises
    ------
    MapError
        The series shrink too slowly, or not at all.
    """
    nats, n_x = -math.log(target), max(terms_until(x, target) for x in seen.by_x)
    return Orders(
        least_degree(seen.by_degree, inner),
        body.harmonics(nats) + 2,
        _mixed(n_x) if half else n_x,
        # m harmonics with the mean, m - 1 without, are 2 m - 1 terms. Charts have one harmonic
        # more: what a chart leaves out is larger than its last harmonic.
        2 * max(terms_until(x, target) for x in seen.by_phase[::2]) + 1,
        2 * max(terms_until(x, target) for x in seen.by_phase[1::2]) - 1,
        energy_nodes(seen.exponent, body.h / half, nats) if half else 1,
        body.arc_length(max(layer.widths)),
    )


def _mixed(n: int) -> int:
    """The number of nodes in d or I, given that which one energy needs.

    The wider a layer is, the more do tables leave out that belongs to d, the phase and the energy
    together. Charts in doubles of three bodies drawn by lot, whose layers are widest, n = 17 to 21,
    err by 0.6 to 4.6 of what is allowed with n nodes, and by 0.006 to 0.03 with so many.
    """
    return n + round(n**3 / 1200)


def energy_nodes(exponent: float, distance: float, nats: float) -> int:
    """The number of Chebyshev nodes in the energy for a truncation error exp(-nats).

    `exponent` is Lambda_0, radians^-1, and `distance` that of the energy 0, where tables are
    singular, from the middle of the interval, in half widths of it. Functions turn with the phase
    s, which contains ln(h)/Lambda_0: on a circle around the middle of the interval that reaches the
    share f of the distance they grow to exp(asin(f)/Lambda_0), and n nodes leave an error of that
    over (2 f distance)^n. The least of these bounds has tan(asin(f)) = n Lambda_0.
    """
    n, error = 0, math.inf
    while error > -nats:
        n += 1
        slope = n * exponent
        gained = n * math.log(2 * distance * slope / math.hypot(1, slope))
        error = math.atan(slope) / exponent - gained
    return n
