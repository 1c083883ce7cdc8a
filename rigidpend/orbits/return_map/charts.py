"""Charts: from the section M3 = 0 to the normal form, and back, as tables.

Short arcs are integrated from nodes on the section towards the upper periodic orbit: forward in
time from upward crossings, backward from downward ones. At their ends the normal form is solved for
u and v; those from one chi end at one phase, so that its series are summed for all of them. Then

    U = u exp(-Lambda(I) (psi - chi)),    V = v exp(Lambda(I) (psi - chi)),
    t - tau - (dt/dpsi) (psi - chi),      theta3 - sigma

are the same wherever along the arc they are taken. They are functions of (d, chi) alone, smooth in
d and periodic in chi, so that a table of few Chebyshev polynomials and Fourier modes holds them.

The inverse charts give (d, chi - s) and the same two constants as functions of I = U V and of
s = chi - ln|U|/Lambda(I) (downward) or chi + ln|V|/Lambda(I) (upward), which no passage changes.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.mechanics.equations import aligned
from rigidpend.numbers import Scalar
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import Precision, correction, precision, rounded
from rigidpend.orbits.return_map.conjugacy import NormalPoint, TorusForm, TorusRates
from rigidpend.orbits.return_map.expansions import gauss
from rigidpend.orbits.return_map.midline import NONE, Layer, Midlines
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm
from rigidpend.orbits.return_map.poincare import rotation_phase, rotation_rate, state_of
from rigidpend.orbits.return_map.reduced import Coefficients, theta3_rate
from rigidpend.orbits.return_map.tables import (
    FORWARD_POWER,
    INVERSE_POWER,
    ChartTable,
    Looked,
    fitted,
)

MOST_ITERATIONS = 30
"""Largest number of Newton's corrections of a point of an inverse chart, in each precision."""
SETTLED = 1e-12
"""Correction in doubles, relative, after which the next one would be rounding."""
UNCOVERED = "the charts of the section do not cover the invariants' range"
RATE = 2.0**-48
"""Share of a small step that remains to be done when the rate that it is divided by is a double."""
SPARE = 2.0**-16
"""Share of a rounding up to which the phase at an arc's end may be off.

Q has a part of mu times the larger of u and v, which turns with the phase. With 1 this hid up to
2^-93 of the smaller one, in a map of 90 bits."""
STRIP = 1.2
"""Assumed distance of the nearest complex singularity of theta3's rate from the middle of an arc.

The unit is that of time on a separatrix, 2/(J2 sin(alpha0)) in t'. Without weight the distance is
pi/2."""


class Arcs(NamedTuple):
    """Arcs from the section towards the periodic orbit: how long, and in which numbers they run."""

    length: Any
    """Duration, t': that of the motion without weight."""
    c: Coefficients
    """Coefficients in the numbers of `a`."""
    a: Precision
    """Sharper than tables by the digits that d loses with its midline."""
    midlines: Midlines = NONE
    """The lines from which d counts where arcs begin."""

    def states(self, rising: bool, d: Scalar, chi: Scalar, form: TorusForm) -> Any:
        """States (6, N) of N points of the section, in the numbers of `a`."""
        a, own, sizes = self.a, self.midlines[rising], form.group_sizes(len(d))
        d, chi, h = a.array(d), a.array(chi), a.array(form.h)
        cos, sin = a.cos(chi), a.sin(chi)
        if own.values.any():
            d = d + own.at(cos, h, sizes, form.nf.energies, a)
        return state_of(rising, d, cos, sin, np.repeat(h, sizes), self.c, a)


def section_chart(rising: bool, d: Scalar, chi: Scalar, form: TorusForm, arcs: Arcs) -> Any:
    """U, V, and the constants of time t' and theta3, at N points of the section: (4, N).

    The points are at d from the midline, and chi. Upward (`rising`) crossings lie beside separatrix
    2, downward ones beside 3. The last row is left out where the normal form has no theta3.

    Raises
    ------
    MapError
        The arcs do not end within the range of the normal form.
    """
    nf, a, c = form.nf, form.a, rounded(arcs.c, form.a)
    shares = parts = a.zeros((0,))
    # theta3 is a quadrature along the arc, by Gauss's rule: its points come before the arc's end.
    if nf.theta3:
        few = quadrature_points(float(arcs.length), c, float(nf.energies.centre), a.bits)
        shares, parts = gauss(few, a)
    path, time, late, turned, at = arc_ends(rising, d, chi, form, arcs, shares)
    rates = form.rates(at.u * at.v)
    # U = u exp(-Lambda turned), V = v exp(Lambda turned), t less what passes beside the orbit.
    stretch = a.exp(rates.exponent * turned)
    found = [at.u / stretch, at.v * stretch, time + late - at.tau - rates.rotation * turned]
    if nf.theta3:
        rate = theta3_rate(path[:3], c)
        inner = time * (parts[:, None] * rate[:-1]).sum(axis=0)
        found.append(inner + late * rate[-1] - at.sigma)
    return np.stack(found)


def arc_ends(
    rising: bool, d: Scalar, chi: Scalar, form: TorusForm, arcs: Arcs, shares: Scalar
) -> tuple[Any, Any, Any, Any, NormalPoint]:
    """The arcs from N points of the section towards the periodic orbit, and u and v where they end.

    The arcs, forwards from upward (`rising`) crossings and backwards from downward ones, end where
    psi - chi is that of the motion without weight after their duration: so those of one chi end at
    one phase, for which the normal form is summed once. The results are the states at
    `shares` of a time t' that nearly leads there, and at this time; this time; what is missing of
    the arc, some roundings of a double; and psi - chi.

    Raises
    ------
    MapError
        The arcs do not end within the range of the normal form.
    """
    a, side = form.a, 1 if rising else -1
    h = np.repeat(form.h, form.group_sizes(len(d)))
    begin, c, sharp = arcs.states(rising, d, chi, form), rounded(arcs.c, a), arcs.a
    turned = free_growth(side, arcs.length, h, c, a)
    # Phases without whole turns, whose rounding would show beside a small u.
    turns = 2 * a.pi * np.round(a.floats((chi + turned) / (2 * a.pi)))
    psi, time = chi + turned - turns, side * a.floats(arcs.length + 0 * d)
    turned = psi - chi + turns
    # Durations in doubles come first, so that one long integration in the full precision suffices.
    low = precision(53)
    few = rounded(c, low)
    path = states_at(few.aligned, sharp.floats(begin), time[None])
    _, late = _ended(path[:, -1], a.floats(psi), few, low)
    time = a.array(time + late)
    grid = np.append(shares, a.array([1.0]))[:, None] * time
    path = a.array(states_at(arcs.c.aligned, begin, sharp.array(grid), sharp.bits))
    end, late = _ended(path[:, -1], psi, c, a)
    return path, time, late, turned, form.inverted(psi, end[0], end[1])


def _ended(state: Any, psi: Scalar, c: Coefficients, a: Precision) -> tuple[Any, Any]:
    """The states where orbits, (6, N), next reach phases psi, and t' until then, of either sign.

    MapError is raised for orbits that are not beside the upper periodic orbit then.
    """
    total, turn = 0 * psi, 2 * a.pi
    for _ in range(MOST_ITERATIONS):
        # Beside the upper orbit M3 is near +J2, whichever way the arc runs in time.
        if not (state[2] > 0).all():
            break
        off = psi - rotation_phase(state, c, a)
        off = off - turn * np.round(a.floats(off / turn))
        step = off / rotation_rate(a.floats(state), a.floats(psi), rounded(c, precision(53)))
        total = total + step
        # What a step along the tangent leaves, by a rate in doubles.
        size = a.largest(step)
        if size * max(size, RATE) < (a.epsilon if a.bits == 53 else SPARE * a.epsilon):
            return state + step * np.stack(aligned(state, c.aligned)), total
        state = states_at(c.aligned, state, step[None], a.bits)[:, 0]
    raise MapError("mu is too large: an orbit from the section does not reach the periodic orbit")


def free_growth(side: int, length: Scalar, h: Scalar, c: Coefficients, a: Precision) -> Any:
    """psi - chi after a time `length`, t', of the motion without weight, radians."""
    # With psi and chi as theta1 and theta2 give them, psi - chi is alpha0/2 - pi on separatrix 2
    # and -alpha0/2 on 3, and grows by kappa J2 in a unit of time.
    alpha0 = 2 * a.atan2(1 / c.to_M2, 1 / c.to_M1)
    free = side * (alpha0 / 2 + c.aligned.kappa * a.sqrt(2 * h / c.aligned.kappa) * length)
    return free - (a.pi if side > 0 else 0)


def quadrature_points(length: float, c: Coefficients, h: float, bits: int) -> int:
    """The number of Gauss points for theta3 along an arc of duration `length`, t'.

    The error of Gauss's rule of n points falls as rho^(-2 n), if rho is the sum of the half axes of
    the largest ellipse around the interval [-1, 1] in which the integrand is analytic.
    """
    k = c.aligned
    J2 = math.sqrt(2 * h / float(k.kappa))
    weight = math.hypot(float(k.mu_r1), float(k.mu_r2)) / h
    # At complex times cos(psi) grows as exp(kappa J2 |Im t|): beyond the height at which mu times
    # this is as large as h the motion is no longer close to that without weight.
    height = min(STRIP / (float(k.half_sigma) * J2), -math.log(weight) / (float(k.kappa) * J2))
    return math.ceil(bits * math.log(2) / 2 / math.asinh(height * 2 / length))


class Chart(NamedTuple):
    """The chart of one section and its inverse: tables over an interval of energies, or at some."""

    forward: ChartTable
    """U, V, and the constants of time and theta3, as functions of (d, chi)."""
    inverse: ChartTable
    """d, chi - s, and the same constants, as functions of (I, s)."""

    def at(self, form: TorusForm) -> Chart:
        """Both at the energies of groups of points."""
        return Chart(self.forward.at(form), self.inverse.at(form))


Charts: TypeAlias = tuple[Chart, Chart]
"""The charts of downward and of upward crossings."""


class Invariants(NamedTuple):
    """The invariants I and s, which no passage changes, with the rates on their tori; (N,) each."""

    I: Any
    s: Any
    rates: TorusRates
    by_d: Any = None
    """Derivatives of I and s in d, if they are asked for."""
    by_chi: Any = None
    """Derivatives of I and s in chi, if they are asked for."""


def forward_table(
    rising: bool, width: Scalar, n_x: int, n_phase: int, nf: NormalForm, arcs: Arcs, a: Precision
) -> ChartTable:
    """The chart of a section as a table over |d| <= width."""

    def chart(d: Any, chi: Any, form: TorusForm) -> Any:
        return section_chart(rising, d, chi, form, arcs)

    return fitted(chart, width, n_x, n_phase, nf, FORWARD_POWER, a)


def inverse_table(
    rising: bool, forward: ChartTable, width: Scalar, n_phase: int, nf: NormalForm, a: Precision
) -> ChartTable:
    """The inverse chart as a table over |I| <= width, found from the table of the chart.

    Raises
    ------
    MapError
        Some of the invariants do not belong to points of the section within the chart.
    """

    def chart(I: Any, s: Any, form: TorusForm) -> Any:
        d, chi, value = _solved(rising, forward.at(form), form, (I, s))
        # chi grows by a turn with s; the difference is periodic in s, as a table has to be.
        return np.stack((d, chi - s, *value[2:]))

    return fitted(chart, width, forward.n_x, n_phase, nf, INVERSE_POWER, a)


def section_charts(
    layer: Layer,
    n_x: int,
    n_phase: int,
    n_phase_inverse: int,
    nf: NormalForm,
    arcs: Arcs,
    a: Precision,
) -> Charts:
    """The charts of both sections over a layer, by n_x nodes and two numbers of phases."""
    found = []
    for rising in (False, True):
        width, reach = a.number(layer.widths[rising]), a.number(layer.widest_I)
        forward = forward_table(rising, width, n_x, n_phase, nf, arcs, a)
        found.append(Chart(forward, inverse_table(rising, forward, reach, n_phase_inverse, nf, a)))
    return found[0], found[1]


def _solved(
    rising: bool, forward: ChartTable, form: TorusForm, goal: tuple[Scalar, Scalar]
) -> tuple[Any, Any, Any]:
    """The points (d, chi) that have the invariants I and s, and the chart's functions there.

    Newton's method runs in doubles; the last corrections are made in the full precision, with the
    slopes in doubles.
    """
    a = form.a
    low = forward._replace(width=float(forward.width), values=a.floats(forward.values))
    rough = a.floats(goal[0]), a.floats(goal[1])
    begin, slopes, at = _newton(rising, low, form.in_doubles, rough)
    d, chi = (a.array(x) for x in begin)
    for _ in range(MOST_ITERATIONS):
        value = forward.look_up(d, chi, a)
        I, s, *_ = invariants(rising, Looked(value), chi, form)
        step, turn = correction(at.by_d, at.by_chi, (I - goal[0], s - goal[1]))
        d, chi = d - step, chi - turn
        # Slopes in doubles leave 2^-40 of a correction, so that the next one would be rounding.
        # The functions of the chart follow the last correction to first order.
        if _size(step, turn, low, a) * 2.0**-40 < a.epsilon:
            return d, chi, value - slopes.by_x * step - slopes.by_phase * turn
    raise MapError(UNCOVERED)


def _newton(
    rising: bool, table: ChartTable, form: TorusForm, goal: tuple[Any, Any]
) -> tuple[tuple[Any, Any], Looked, Invariants]:
    """The points in doubles, with the chart's functions, the invariants and their slopes there."""
    a = form.a
    d, chi = 0 * goal[0], goal[1] + 0
    # Where passages are long chi and s are many turns apart, by nearly as much at all points.
    begun = Looked(table.look_up(d, chi, a))
    chi = chi - (invariants(rising, begun, chi, form).s - goal[1])
    for _ in range(MOST_ITERATIONS):
        seen = table.look_up_slopes(d, chi, a)
        at = invariants(rising, seen, chi, form)
        step, turn = correction(at.by_d, at.by_chi, (at.I - goal[0], at.s - goal[1]))
        # Chebyshev polynomials grow fast beyond the width: a step that went too far is cut short.
        d, chi = np.clip(d - step, -2 * table.width, 2 * table.width), chi - turn
        if _size(step, turn, table, a) < SETTLED:
            if a.largest(d) <= table.width:
                return (d, chi), seen, at
            break
    raise MapError(UNCOVERED)


def _size(step: Any, turn: Any, table: ChartTable, a: Precision) -> float:
    """The size of a correction: of d relative to the width, and of chi in radians."""
    return a.largest(step) / float(table.width) + a.largest(turn)


def invariants(by_v: bool, seen: Looked, chi: Scalar, form: TorusForm) -> Invariants:
    """I and s of points of a section, with their derivatives in (d, chi) if `seen` has slopes.

    `by_v` takes s = chi + ln|V|/Lambda(I), as inverse charts of upward crossings do; otherwise
    s = chi - ln|U|/Lambda(I). The two differ by ln|I|/Lambda(I), so no passage changes either.
    """
    (U, V), which, side = seen.value[:2], int(by_v), 1 if by_v else -1
    I, W = U * V, seen.value[which]
    rates = form.rates(I)
    depth = form.a.log(np.abs(W)) / rates.exponent
    s = chi + depth if by_v else chi - depth
    if seen.by_x is None:
        return Invariants(I, s, rates)
    # d(depth) = (+-dW/W - depth Lambda' dI)/Lambda, with the sign in `depth` from here on.
    slopes, depth = [], s - chi
    for own, by in enumerate((seen.by_x, seen.by_phase)):
        of_I = U * by[1] + V * by[0]
        of_depth = side * by[which] / W - depth * rates.exponent_slope * of_I
        slopes.append((of_I, own + of_depth / rates.exponent))
    return Invariants(I, s, rates, *slopes)
