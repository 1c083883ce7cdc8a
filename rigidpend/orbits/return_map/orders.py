"""Orders of the tables: how many terms a body, an energy and a precision need.

A first look at the charts, in doubles and of low order, measures how far the orbits' layer
reaches; a second one, at one energy, how fast the terms of the normal form and of the charts
shrink over this layer. Where they do not, tables reach less far, and some orbits leave them.
Whether they are small enough is measured on the finished tables.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from rigidpend.orbits.return_map.charts import (
    FORWARD,
    INVERSE,
    ChartTable,
    arcs,
    forward_table,
    inverse_table,
    quadrature_points,
    table_sizes,
)
from rigidpend.orbits.return_map.checks import Errors
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import Interval, phases
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm, normal_form, powers
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import Coefficients


def layer_width(nu: float) -> float:
    """About the largest |I| of orbits over what is called splitting here, from below 6 on.

    That holds what both surfaces are displaced by, beside which they are split by ever less where
    nu grows. Of 24 bodies drawn by lot, 60 orbits each through 100 passages, tables that reach to
    10, the largest |I| was 5.5 where nu = 2.1, 1.8 to 4.5 where it was 2.5 to 4.5, 1.36 at 5.3,
    1.14 at 6.3, 0.28 at 7.9, 0.1 at 9.7 and 0.03 at 11.2.
    """
    return 55 * math.exp(-0.65 * nu)


LEAST_REACH, MOST_REACH = 1.0, 5.5
"""Least and largest reach of the tables in |I|, in units of the splitting."""
SHORTER, SHORTEST = 0.8, 2.2
"""Factor by which the reach is shortened where series do not shrink so far, and the least of it.

Of 20,000 orbits of a body drawn by lot 1.8 % leave tables of a reach of 4 on 15 passages, and 2 %
those of 3; of another one 31 % leave tables of a reach of 2.2, and 79 % those of 1.6."""
THINNEST = 2.0**-40
"""Width of a layer, in these units, in which tables in pairs of doubles keep too few digits."""
MARGIN = 1.15
"""Margin of the width in d over the least that the first look finds."""
LARGEST_RADIUS = 0.5
"""Largest radius of u and v, in units of their size at the singularity.

Beyond it a series needs too many terms."""
LOOK = 3, 9, 7
"""Sizes of the first look: nodes in d and in chi, degree of the normal form."""
SECOND_LOOK = 21
"""Largest degree of the normal form in the second look."""
DOUBLES = 53 * math.log(2)
"""Natural logarithm of one over a rounding of doubles."""
NOISE = 1e-12
"""Relative size from which on terms in doubles tell how fast they shrink."""
TINY = 1e-17
"""Relative size below which terms in doubles tell nothing more."""
SLOWEST = 0.05
"""Least natural logarithm by which terms shrink from order to order."""
MOST_DEGREE = 52
"""Largest degree of the normal form in doubles; it grows in proportion to the bits."""
ENDS = 16
"""Phases at the ends of a table's width at which the second look measures where arcs end."""
TOLD = 2
"""Factor by which tables may err more than their last coefficients."""
MORE = 1.2
"""Factor by which orders are raised for another attempt; those of the normal form at most."""


class Orders(NamedTuple):
    """Sizes of the tables and of the normal form."""

    degree: int
    n_phase_orbit: int
    """Phases of the normal form."""
    n_x: int
    """Chebyshev nodes in d and in I."""
    n_phase: int
    """Phases of a chart."""
    n_phase_inverse: int
    """Phases of an inverse chart."""
    n_energy: int
    length: float
    """Length of the arcs, t'."""

    def larger(self, errors: Errors, allowed: float) -> Orders:
        """The orders for another attempt, more of those that the errors tell to be too small."""
        small, told = allowed / 8, TOLD * max(errors[-3:])
        x, phase, energy = (MORE if tail > small else 1.0 for tail in errors[-3:])
        if errors.inverse > max(told, allowed / 2):
            # By terms of both, for an inverse chart is solved from the chart's own table.
            phase = energy = MORE
        # A degree more gains as much as those before it.
        share = math.log(max(errors.charts, 2 * small) / small) / -math.log(small)
        # What the tails don't tell of a chart is the normal form's own.
        own = errors.charts > told or x == phase == energy == 1
        inner = min(MORE, 1 + share) if own else 1.0
        return Orders(
            _odd(self.degree * inner),
            _odd(self.n_phase_orbit * inner),
            math.ceil(self.n_x * x),
            _odd(self.n_phase * phase),
            _odd(self.n_phase_inverse * phase),
            math.ceil(self.n_energy * energy),
            self.length,
        )

    def designed(self, unit: float, stretch: float, more: int) -> Orders:
        """Those of a design, in its unit."""
        return Orders(
            self.degree + more,
            self.n_phase_orbit + more,
            self.n_x + more // 2,
            self.n_phase + more,
            self.n_phase_inverse + more,
            self.n_energy + more // 2 if self.n_energy > 1 else 1,
            self.length / unit * stretch,
        )


class Layer(NamedTuple):
    """The layer of orbits that the tables are to hold."""

    invariant: float
    """Largest |I|."""
    widths: tuple[float, float]
    """Largest |d| on downward and upward crossings."""

    def in_unit(self, unit: float) -> Layer:
        """The same in another unit of M."""
        return Layer(self.invariant * unit**2, (self.widths[0] * unit, self.widths[1] * unit))


class Rough(NamedTuple):
    """A body at an energy, in doubles: how far and how fast orbits go, nearly as without weight."""

    c: Coefficients
    h: float

    @property
    def rate(self) -> float:
        """Rate of the separatrices in 1/t'."""
        return math.sqrt(2 * self.h / self.c.aligned.kappa) * self.c.aligned.half_sigma

    def radius(self, width: float) -> float:
        """|u| and |v| at the arcs' ends, in units of their size at the nearest singularity.

        Without weight Qp is Q/cosh(x) on separatrix 2, v = 2 Q exp(-x), u = d exp(x)/2 and
        Q = J2 sin(alpha0); the arcs from d = width end where |u| = |v|.
        """
        return math.sqrt(width / (8 * self.rate))

    def border(self, width: float) -> float:
        """|u| and |v| at the ends of arcs from points at d = width."""
        return 4 * self.rate * self.radius(width)

    def arc_length(self, width: float) -> float:
        """The length t' of arcs after which |u| = |v| for points at d = width.

        Raises
        ------
        MapError
            The layer is so wide that no such arc is short of the singularity.
        """
        r = self.radius(width)
        if r > LARGEST_RADIUS:
            raise MapError(
                f"mu is too large: the layer around the separatrices, |d| up to {width:.2g},"
                f" reaches {r:.2g} of the normal form's radius, more than {LARGEST_RADIUS}"
            )
        return -math.log(r) / self.rate

    def nodes(self, width: float, nats: float) -> int:
        """The number of Chebyshev nodes in d, by the rate of the leading terms."""
        return math.ceil(nats / -math.log(min(0.5, 2 * self.radius(width) ** 2)) + 1)

    def harmonics(self, nats: float) -> int:
        """The number of Fourier terms: the harmonics of order k are of order (mu/h)^k."""
        mu = math.hypot(self.c.aligned.mu_r1, self.c.aligned.mu_r2)
        return _odd(2 * nats / -math.log(min(0.5, 2 * mu / self.h)) + 1)

    def cost(self, o: Orders, bits: int, *, theta3: bool) -> float:
        """Seconds of a core for tables of some orders, made in pairs of doubles.

        Of 15 bodies drawn by lot tables that took 0.16 to 2.6 s cost 0.9 to 1.12 times as much.
        """
        of = o.n_energy, FORWARD
        charts = sum(math.prod(x) for x in table_sizes(o.n_x, o.n_phase, *of))
        of = o.n_energy, INVERSE
        inverses = sum(math.prod(x) for x in table_sizes(o.n_x, o.n_phase_inverse, *of))
        terms = (o.degree + 1) * (o.degree + 3) / 4 * o.n_phase_orbit
        points = quadrature_points(o.length, self.c, self.h, bits)
        arc = 60 + 0.9 * points * theta3 + 0.004 * terms
        back = 20 + 0.011 * o.n_x * o.n_phase_inverse
        series = 0.018 * o.n_energy * o.n_phase_orbit * o.degree**3
        return 0.03 + (2 * charts * arc + 2 * inverses * back + series) * 1e-6


def looks(body: Rough) -> tuple[Layer, Shrinking]:
    """Two looks at a body: the layer of its orbits, or so much of it as series reach, and these.

    Raises MapError where there is no map; its reason is that of the whole layer.
    """
    reach, refused = whole_reach(body), None
    while refused is None or reach >= SHORTEST:
        try:
            layer = first_look(body, reach)
            return layer, second_look(body, layer)
        except MapError as reason:
            refused, reach = refused or reason, reach * SHORTER
    raise refused


def whole_reach(body: Rough) -> float:
    """The reach of tables that hold all orbits; MapError where nothing is split, or too little."""
    k = body.c.aligned
    if not k.force_p and not k.force_m:
        raise MapError("without weight (mu = 0) nothing is split and no map is needed")
    wide = layer_width(math.pi * k.kappa / (2 * k.half_sigma))
    if wide < THINNEST:
        told = f"some {wide:.1g}" if wide else "less than 1e-300"
        raise MapError(
            "the body is nearly symmetric: its surfaces are split by less than the tables resolve,"
            f" {told} of what both are displaced by"
        )
    return min(max(wide, LEAST_REACH), MOST_REACH)


def first_look(body: Rough, reach: float) -> Layer:
    """Estimate a layer's width: so many times the splitting, from charts of low order.

    Raises MapError where it is too wide.
    """
    (c, h), k, a = body, body.c.aligned, precision(53)
    guess = max(abs(k.force_p), abs(k.force_m)) * math.pi / 2 / body.rate
    n_x, n_phase, degree = LOOK
    length = body.arc_length(guess)
    nf = normal_form(c, Interval(h, 0.0, 1), degree, body.harmonics(DOUBLES), 0.0, a)
    splittings, slopes = [], []
    for rising in (False, True):
        table = forward_table(rising, guess, n_x, n_phase, nf, c, length, a)
        at = phases(36, a)
        seen = table.at(TorusForm(nf, np.full(1, h), a)).look_up_slopes(0 * at, at, a)
        U, V = seen.value[:2]
        splittings.append(float(np.abs(U * V).max()))
        slopes.append(float(np.abs(U * seen.by_x[1] + V * seen.by_x[0]).min()))
    invariant = reach * max(splittings)
    low, high = (
        MARGIN * (invariant + split) / slope
        for split, slope in zip(splittings, slopes, strict=True)
    )
    return Layer(invariant, (low, high))


class Shrinking(NamedTuple):
    """Largest terms of each order over a layer, relative to the largest of all."""

    by_degree: Any
    """Those of the normal form, of degrees 1, 3, ..."""
    by_x: tuple[Any, ...]
    """Those of charts and inverse charts, downward and upward, by polynomials of d or I."""
    by_phase: tuple[Any, ...]
    """The same by harmonics."""


def second_look(body: Rough, layer: Layer) -> Shrinking:
    """Measure how fast the terms of the normal form and of the charts shrink, at one energy.

    Raises MapError where the series shrink too slowly, or the arcs do not end within them.
    """
    width, a, at = max(layer.widths), precision(53), Interval(body.h, 0.0, 1)
    length, border, n = body.arc_length(width), body.border(width), body.harmonics(DOUBLES)
    nf = normal_form(body.c, at, SECOND_LOOK, n, border, a, least=TINY)
    degrees = powers(nf.degree, 1).sum(axis=1)
    sizes = np.abs(nf.odd[:, :, :2]).max(axis=(0, 2)) * _reach(body, layer, nf) ** degrees
    by_degree = np.array([sizes[degrees == D].max() for D in range(1, nf.degree + 1, 2)])
    by_degree = by_degree / by_degree[0]
    degree = _degree(by_degree, 2.0**-53)
    if degree > MOST_DEGREE:
        raise MapError(
            f"mu is too large: the normal form shrinks so slowly over the layer around the"
            f" separatrices, |d| up to {width:.2g}, that it takes the degree {degree}"
        )
    tables = []
    for rising in (False, True):
        sizes = rising, a.number(layer.widths[rising]), body.nodes(width, DOUBLES), nf.n
        forward = forward_table(*sizes, nf, body.c, length, a)
        tables += [forward, inverse_table(rising, forward, layer.invariant, nf.n, nf, a)]
    by_x, by_phase = zip(*(_by_order(table) for table in tables), strict=True)
    return Shrinking(by_degree, by_x, by_phase)


def _reach(body: Rough, layer: Layer, nf: NormalForm) -> float:
    """|u| and |v| where arcs from the ends of both sections' widths end: their geometric mean.

    A term u^j v^k of the normal form is largest there. The `border`, which is that of orbits
    without weight, is 1.1 to 1.3 times less, and terms of degree 50 are a million times less there.
    """
    found, length = 0.0, body.arc_length(max(layer.widths))
    for rising, width in zip((False, True), layer.widths, strict=True):
        form = TorusForm(nf, np.full(1, body.h), precision(53))
        d, chi = np.repeat([-width, width], ENDS), np.tile(phases(ENDS, form.a), 2)
        *_, at = arcs(rising, d, chi, form, body.c, np.array([length]))
        found = max(found, np.abs(at.u).max() * np.abs(at.v).max())
    return math.sqrt(found)


def orders(
    body: Rough, half: float, layer: Layer, seen: Shrinking, target: float, inner: float
) -> Orders:
    """The orders whose first terms left out are below `target`, relative.

    Those of the normal form are below `inner`. Energies differ by up to `half` from that of the
    looks.

    Raises
    ------
    MapError
        The series shrink too slowly, or not at all.
    """
    nats = -math.log(target)
    return Orders(
        _degree(seen.by_degree, inner),
        body.harmonics(nats) + 2,
        max(_enough(x, target) for x in seen.by_x),
        # One harmonic more: what a chart leaves out is larger than its last one.
        2 * max(_enough(x, target) for x in seen.by_phase[::2]) + 1,
        2 * max(_enough(x, target) for x in seen.by_phase[1::2]) - 1,
        math.ceil(nats / math.log(2 * body.h / half) + 1) if half else 1,
        body.arc_length(max(layer.widths)),
    )


def _degree(by_degree: Any, target: float) -> int:
    """The degree of the normal form whose first terms left out are below a target."""
    return 2 * _enough(by_degree, target) + 1


def _by_order(table: ChartTable) -> tuple[Any, Any]:
    """The largest coefficients of a table for each order in x and each harmonic, relative."""
    sizes = np.abs(table.values[0].reshape(table.n_x, table.n_phase, -1))
    sizes = (sizes / np.maximum(sizes.max(axis=(0, 1)), TINY)).max(axis=2)
    phase = sizes.max(axis=0)
    return sizes.max(axis=1), np.append(phase[0], np.maximum(phase[1::2], phase[2::2]))


def _enough(sizes: Any, target: float) -> int:
    """Number of terms that come before those below a target, by the rate at which they shrink."""
    logs = np.log(np.maximum(np.maximum.accumulate(sizes[::-1])[::-1], TINY))
    last = min(len(logs) - 1, 1 + int(np.flatnonzero(logs > math.log(NOISE)).max()))
    first = last // 2
    rate = (logs[first] - logs[last]) / (last - first)
    if rate < SLOWEST:
        raise MapError("mu is too large: the series of the map do not shrink")
    return max(2, math.ceil(last + (logs[last] - math.log(target)) / rate))


def _odd(x: float) -> int:
    """The next odd number."""
    return 2 * math.ceil((x - 1) / 2) + 1
