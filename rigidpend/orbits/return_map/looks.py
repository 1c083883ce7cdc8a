"""Two looks at a body: how wide its layer of orbits is, and how fast its series shrink over it.

A first look at the charts, in doubles and of low order, measures how wide the layer of orbits is.
A second look, at one energy, measures how fast the terms of the normal form and of the charts
shrink over this layer. If they do not shrink, tables of a thinner layer are tried, which some
orbits will leave.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rigidpend.orbits.precision import MOST_IN_PAIRS, Precision, precision
from rigidpend.orbits.return_map.charts import (
    Arcs,
    arc_ends,
    forward_table,
    section_chart,
    section_charts,
)
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import Interval, phases
from rigidpend.orbits.return_map.midline import Layer, Midlines, midline
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm, normal_form, powers
from rigidpend.orbits.return_map.reduced import Coefficients
from rigidpend.orbits.return_map.tables import ChartTable


def layer_width(nu: float) -> float:
    """Estimate of the largest |I| of orbits, in units of the splitting, for results below 6.

    The splitting is |I| at d = 0 (see :func:`first_look`). It contains the displacement that both
    surfaces share, which exceeds their distance the more the larger nu = pi kappa/sin(alpha0) is.
    Of 24 bodies drawn by lot, 60 orbits each through 100 passages, tables that reach to 10, the
    largest |I| was 5.5 where nu = 2.1, 1.8 to 4.5 where nu was 2.5 to 4.5, 1.36 at 5.3, 1.14 at
    6.3, 0.28 at 7.9, 0.1 at 9.7 and 0.03 at 11.2.
    """
    return 55 * math.exp(-0.65 * nu)


LEAST_REACH, MOST_REACH = 1.0, 5.5
"""Least and largest reach of the tables in |I|, in units of the splitting."""
SHORTER, SHORTEST = 0.8, 2.2
"""Factor by which the reach is shortened while series do not shrink over it; least reach tried.

Of 20,000 orbits of a body drawn by lot 1.8 % leave tables of reach 4 within 15 passages, and 2 %
those of reach 3; of another body 31 % leave tables of reach 2.2, and 79 % those of reach 1.6."""
THINNEST = 2.0**-40
"""Width of a layer, in the same units, below which pairs of doubles keep too few digits."""
MARGIN = 1.15
"""Factor of the width in d over the least width that the first look finds."""
LARGEST_RADIUS = 0.5
"""Largest |u| and |v| at the ends of arcs, in units of their size at the nearest singularity.

Beyond it the series need too many terms."""
NARROWEST = 1 / 80
"""Least |v| at the end of arcs, in the same units: u may be smaller.

Arcs in sums of three doubles take most of the time of tables beside a midline."""
FIRST_LOOK = 3, 9, 7
"""Sizes of the first look: nodes in d and in chi, degree of the normal form."""
SECOND_LOOK = 21
"""Largest degree of the normal form in the second look."""
DOUBLES = 53 * math.log(2)
"""Natural logarithm of one over a rounding of doubles."""
NOISE = 1e-12
"""Relative size above which terms in doubles show how fast they shrink."""
TINY = 1e-17
"""Relative size below which terms in doubles are nothing but rounding."""
SLOWEST = 0.05
"""Least decrease of the natural logarithm of terms from order to order, for a map to be made."""
MOST_DEGREE = 60
"""Largest degree of the normal form in doubles; with more bits it grows in proportion to them.

In doubles tables of the degree 51 take a second, and those of 71 and 93 three and six."""
LOOK = 64
"""Bits of a second look at a thinner layer, beside those by which it is thinner."""
TRIM = 2.0**-6
"""Size of the terms that midlines leave out, in widths of the layer.

Smaller terms are roundings of doubles, each a harmonic that the tables would have to hold."""
MIDLINE_ENERGIES, MIDLINE_STEPS = 6, 12
"""Nodes of the energy of midlines, and the largest number of steps of secants."""
NEAREST = 2.0**-11
"""Least width, over the rate of separatrices, for which arcs to midlines are made longer."""
ENDS = 16
"""Phases at the ends of a table's width at which the second look measures where arcs end."""


class Rough(NamedTuple):
    """Rough sizes and rates of orbits at an energy, in doubles and mostly as without weight."""

    c: Coefficients
    h: float

    @property
    def nu(self) -> float:
        """The paper's nu, pi kappa/sin(alpha0)."""
        return math.pi * self.c.aligned.kappa / (2 * self.c.aligned.half_sigma)

    @property
    def displacement(self) -> float:
        """Size of d on the surfaces, to first order in mu.

        A force that turns with the rate kappa J2 = (2 nu/pi) `rate` shifts them by some
        (pi/2)/sqrt(1 + nu^2) of what it does in the time 1/`rate`.
        """
        k = self.c.aligned
        force = max(abs(k.force_p), abs(k.force_m))
        return force * math.pi / 2 / (math.hypot(1, self.nu) * self.rate)

    @property
    def rate(self) -> float:
        """Rate of the motion on separatrices, J2 sin(alpha0)/2, in 1/t'."""
        return math.sqrt(2 * self.h / self.c.aligned.kappa) * self.c.aligned.half_sigma

    def radius(self, width: float) -> float:
        """|u| and |v| at the arcs' ends, in units of their size at the nearest singularity.

        Without weight Qp is Q/cosh(x) on separatrix 2, v = 2 Q exp(-x), u = d exp(x)/2 and
        Q = J2 sin(alpha0) = 2 `rate`. The arcs from d = width end where |u| = |v| = sqrt(Q d), and
        the series in v converge for |v| < 2 Q.
        """
        return max(NARROWEST, math.sqrt(width / (8 * self.rate)))

    def border(self, width: float) -> float:
        """|u| and |v| at the ends of arcs from points at d = width, dimensionless as M."""
        return 4 * self.rate * self.radius(width)

    def arc_length(self, width: float) -> float:
        """The duration t' of arcs from points at d = width to where |u| = |v|.

        Raises
        ------
        MapError
            The layer is so wide that u and v are beyond `LARGEST_RADIUS` there.
        """
        r = self.radius(width)
        if r > LARGEST_RADIUS:
            raise MapError(
                f"mu is too large: the layer around the separatrices, |d| up to {width:.2g},"
                f" reaches {r:.2g} of the normal form's radius, more than {LARGEST_RADIUS}"
            )
        # There x = -ln(r), and x grows at the rate of the separatrix.
        return -math.log(r) / self.rate

    def nodes(self, width: float, nats: float) -> int:
        """The number of Chebyshev nodes in d for a truncation error exp(-nats).

        The leading terms fall as (2 r^2)^k, with r from :meth:`radius`.
        """
        return math.ceil(nats / -math.log(min(0.5, width / (4 * self.rate))) + 1)

    def harmonics(self, nats: float) -> int:
        """The number of Fourier terms for a truncation error exp(-nats).

        The harmonics of order k are of order (mu/h)^k, and are taken to fall as (2 mu/h)^k.
        """
        mu = math.hypot(self.c.aligned.mu_r1, self.c.aligned.mu_r2)
        return odd(2 * nats / -math.log(min(0.5, 2 * mu / self.h)) + 1)


def looks(
    body: Rough, half: float, narrower: int, sharp: Callable[[Precision], Coefficients]
) -> tuple[Layer, Shrinking]:
    """The layer of a body's orbits, or the part of it over which series shrink, and how fast.

    If `narrower` bits are given, the layer is so much narrower than the displacement of the
    surfaces, and lies around their midlines over energies up to `half` from that of the body.
    `sharp` gives the coefficients in a precision.

    Raises MapError if there is no map. The reason is the one found for the whole layer, not for the
    thinner ones tried after it.
    """
    if narrower:
        _check_weight(body)
        layer = first_look(body, 2.0**-narrower)
        layer = layer._replace(midlines=midlines(body, half, TRIM * min(layer.widths)))
        a = precision(min(MOST_IN_PAIRS, LOOK + narrower))
        return layer, second_look(body, layer, sharp(a), a)
    reach, refused = whole_reach(body), None
    while refused is None or reach >= SHORTEST:
        try:
            layer = first_look(body, reach)
            return layer, second_look(body, layer, body.c, precision(53))
        except MapError as reason:
            refused, reach = refused or reason, reach * SHORTER
    raise refused


def whole_reach(body: Rough) -> float:
    """The reach in |I| of tables that hold all orbits, in units of the splitting.

    Raises MapError if nothing is split, or too little.
    """
    _check_weight(body)
    wide = layer_width(body.nu)
    if wide < THINNEST:
        # The width of nearly symmetric bodies may underflow to zero.
        told = f"some {wide:.1g}" if wide else "less than 1e-300"
        raise MapError(
            "the body is nearly symmetric: its surfaces are split by less than the tables resolve,"
            f" {told} of what both are displaced by"
        )
    return min(max(wide, LEAST_REACH), MOST_REACH)


def _check_weight(body: Rough) -> None:
    """Raise MapError if nothing is split."""
    k = body.c.aligned
    if not k.force_p and not k.force_m:
        raise MapError(
            "without weight (mu = 0) an orbit repeats one passage or never returns, so that no code"
            " can be chosen, and there is no return map: give mu > 0"
        )


def first_look(body: Rough, reach: float) -> Layer:
    """Estimate the layer that is `reach` times the splitting wide, from charts of low order.

    Raises MapError if it is too wide.
    """
    (c, h), a = body, precision(53)
    guess, thin = body.displacement, reach < LEAST_REACH
    n_x, n_phase, degree = FIRST_LOOK
    arcs = Arcs(body.arc_length(guess), c, a)
    n = body.harmonics(DOUBLES)
    nf = normal_form(c, Interval(h, 0.0, 1), degree, n, 0.0, a, theta3=False)
    splittings, slopes = [], []
    for rising in (False, True):
        table = forward_table(rising, guess, n_x, n_phase, nf, arcs, a)
        # Without weight I = 0 along d = 0: there its size measures the splitting.
        at = phases(36, a)
        seen = table.at(TorusForm(nf, nf.energies.nodes(a), a)).look_up_slopes(0 * at, at, a)
        U, V = seen.value[:2]
        splittings.append(float(np.abs(U * V).max()))
        slopes.append(float(np.abs(U * seen.by_x[1] + V * seen.by_x[0]).min()))
    invariant = reach * max(splittings)
    # |I| is at least slope |d| - split, so that it exceeds `invariant` beyond this width. From the
    # midline on, `split` is far below the invariants of a layer.
    low, high = (
        MARGIN * (invariant + (invariant / 8 if thin else split)) / slope
        for split, slope in zip(splittings, slopes, strict=True)
    )
    return Layer(invariant, (low, high))


class Shrinking(NamedTuple):
    """Largest terms of each order over a layer, relative to the largest of all orders."""

    by_degree: Any
    """Terms of the normal form, of degrees 1, 3, ..."""
    by_x: tuple[Any, ...]
    """Terms of four tables by Chebyshev polynomial of d or I.

    The tables are the chart and the inverse chart of downward, then of upward crossings."""
    by_phase: tuple[Any, ...]
    """Terms of the same four tables by harmonic of the phase."""
    exponent: float
    """The Floquet exponent Lambda_0, radians^-1."""


def midlines(body: Rough, half: float, least: float) -> Midlines:
    """The midlines of both sections over energies up to `half` from that of the body.

    Terms of d below `least` are left out.

    Raises
    ------
    MapError
        A surface does not reach the section, or is not found up to `least`.
    """
    (c, h), a, n = body, precision(53), body.harmonics(DOUBLES)
    energies = Interval(h, half, MIDLINE_ENERGIES if half else 1)
    nf = normal_form(c, energies, FIRST_LOOK[2], n, 0.0, a, theta3=False)
    form = TorusForm(nf, energies.nodes(a), a, [n] * energies.n)
    chi, found = np.tile(phases(n, a), energies.n), []
    for rising in (False, True):
        # Secants find where U is zero, or V downward. Both are nearly linear in d. The closer d
        # is, the longer are the arcs, so that so few terms of the normal form suffice.
        width = body.displacement
        d, step, value = 0 * chi, 0 * chi + width / 2, 0 * chi
        for _ in range(MIDLINE_STEPS):
            known, arcs = value, Arcs(body.arc_length(width), c, a)
            value = section_chart(rising, d, chi, form, arcs)[0 if rising else 1]
            if np.abs(step).max() < least:
                break
            if known.any():
                # Where both values are the same the surface is found, to a rounding.
                change = np.where(value == known, np.inf, value - known)
                step = -value * step / change
            d, width = d + step, max(width / 8, NEAREST * body.rate)
        else:
            raise MapError("the surfaces' common displacement is not found in doubles")
        found.append(midline(d.reshape(energies.n, n), least))
    return found[0], found[1]


def second_look(body: Rough, layer: Layer, c: Coefficients, a: Precision) -> Shrinking:
    """Measure how fast the terms of the normal form and of the charts shrink, at one energy.

    `c` are the coefficients of the body in the precision `a`.

    Raises MapError if the series shrink too slowly, or the arcs do not end within their range.
    """
    low, up = (line.middle() for line in layer.midlines)
    at, width = Interval(a.number(body.h), a.number(0), 1), max(layer.widths)
    arcs = Arcs(a.number(body.arc_length(width)), c, a, (low, up))
    border, n = body.border(width), body.harmonics(DOUBLES)
    # Maps of thin layers are for route codes, which need no theta3: it takes a sum over each arc.
    thin = any(line.values.any() for line in layer.midlines)
    nf = normal_form(c, at, SECOND_LOOK, n, border, a, theta3=not thin, least_share=TINY)
    sizes = np.abs(a.floats(nf.odd[:, :2])).max(axis=(0, 1)) * _largest(layer, nf, arcs)
    degrees = powers(nf.degree, 1).sum(axis=1)
    by_degree = np.array([sizes[degrees == D].max() for D in range(1, nf.degree + 1, 2)])
    by_degree = by_degree / by_degree[0]
    # If the series shrink too slowly even for doubles, they could not be inverted below either.
    degree = least_degree(by_degree, 2.0**-53)
    if degree > MOST_DEGREE:
        raise MapError(
            f"mu is too large: the normal form shrinks so slowly over the layer around the"
            f" separatrices, |d| up to {width:.2g}, that it takes the degree {degree}"
        )
    charts = section_charts(layer, body.nodes(width, DOUBLES), nf.n, nf.n, nf, arcs, a)
    found = (_by_order(table) for chart in charts for table in chart)
    by_x, by_phase = zip(*found, strict=True)
    return Shrinking(by_degree, by_x, by_phase, float(nf.exponent[0, 0]))


def _largest(layer: Layer, nf: NormalForm, arcs: Arcs) -> Any:
    """The largest |u^j v^k| where arcs from the ends of both sections' widths end, by `powers`.

    The `border`, an estimate for orbits without weight, is smaller than |u| and |v| there by a
    factor of 1.1 to 1.3, which makes terms of degree 50 smaller by up to half a million.
    """
    a, found = arcs.a, []
    j, k = powers(nf.degree, 1).T
    for rising, width in zip((False, True), layer.widths, strict=True):
        form = TorusForm(nf, nf.energies.nodes(a), a)
        d, chi = a.array(np.repeat([-width, width], ENDS)), np.tile(phases(ENDS, a), 2)
        *_, at = arc_ends(rising, d, chi, form, arcs, a.zeros((0,)))
        u, v = a.largest(at.u), a.largest(at.v)
        found.append(u**j * v**k)
    return np.maximum(*found)


def least_degree(by_degree: Any, target: float) -> int:
    """The odd degree at which the first terms of the normal form left out are below a target."""
    return 2 * terms_until(by_degree, target) + 1


def _by_order(table: ChartTable) -> tuple[Any, Any]:
    """The largest coefficients of a table for each order in x, and for each harmonic.

    They are relative to the largest of the same function.
    """
    sizes = np.abs(table.values[0].astype(float)).reshape(table.n_x, table.n_phase, -1)
    sizes = (sizes / np.maximum(sizes.max(axis=(0, 1)), TINY)).max(axis=2)
    # The cosine and the sine of a harmonic count as one.
    phase = sizes.max(axis=0)
    return sizes.max(axis=1), np.append(phase[0], np.maximum(phase[1::2], phase[2::2]))


def terms_until(sizes: Any, target: float) -> int:
    """The number of terms that are not below a target, by the rate at which terms shrink."""
    # Each size is replaced by the largest at or behind it: some orders vanish by symmetry.
    logs = np.log(np.maximum(np.maximum.accumulate(sizes[::-1])[::-1], TINY))
    # The rate is taken from the second half of the terms above noise, and carried on beyond.
    last = min(len(logs) - 1, 1 + int(np.flatnonzero(logs > math.log(NOISE)).max()))
    first = last // 2
    rate = (logs[first] - logs[last]) / (last - first)
    if rate < SLOWEST:
        raise MapError("mu is too large: the series of the map do not shrink")
    return max(2, math.ceil(last + (logs[last] - math.log(target)) / rate))


def odd(x: float) -> int:
    """The least odd number that is not below x."""
    return 2 * math.ceil((x - 1) / 2) + 1
