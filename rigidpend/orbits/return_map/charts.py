"""Charts: from the section M3 = 0 to the normal form, and back, as tables.

Short arcs are integrated from nodes on the section towards the upper periodic orbit: forward in
time from upward crossings, backward from downward ones. At their ends the normal form is solved for
u and v. Then

    U = u exp(-Lambda(I) (psi - chi)),    V = v exp(Lambda(I) (psi - chi)),
    t - tau - (dt/dpsi) (psi - chi),      theta3 - sigma

are the same wherever along the arc they are taken. They are functions of (d, chi) alone, smooth in
d and periodic in chi, so that a table of few Chebyshev polynomials and Fourier modes holds them.

The inverse charts give (d, chi - s) and the same two constants as functions of I = U V and of
s = chi - ln|U|/Lambda(I) (downward) or chi + ln|V|/Lambda(I) (upward), which no passage changes.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.conjugacy import NormalPoint, TorusForm, TorusRates
from rigidpend.orbits.return_map.expansions import (
    chebyshev_analysis,
    chebyshev_basis,
    chebyshev_slopes,
    chebyshev_synthesis,
    fourier_analysis,
    fourier_basis,
    fourier_slopes,
    fourier_synthesis,
    gauss,
    grouped,
    in_blocks,
    nodes,
    phases,
)
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm
from rigidpend.orbits.return_map.poincare import rotation_phase, section_state
from rigidpend.orbits.return_map.precision import Precision, correction, precision, product
from rigidpend.orbits.return_map.reduced import Coefficients, theta3_rate

MOST_ITERATIONS = 30
"""Largest number of Newton's corrections of a point of an inverse chart, in each precision."""
SETTLED = 1e-12
"""Correction in doubles, relative, after which the next one would be rounding."""
UNCOVERED = "the charts of the section do not cover the invariants' range"
STRIP = 1.2
"""Assumed distance of the nearest complex singularity of theta3's rate from the middle of an arc.

The unit is that of time on a separatrix, 2/(J2 sin(alpha0)) in t'. Without weight the distance is
pi/2."""
FORWARD_POWER, INVERSE_POWER = 1, 3
"""Powers of charts and of inverse charts by which the orders shrink with the energy's order.

See :func:`fitted`."""
SPARE_X, SPARE_PHASES = 1, 2
"""Further nodes in x and in phase, beyond its share, of each divided difference in the energy."""


class Looked(NamedTuple):
    """The F functions of a table, and their derivatives if they are asked for, (F, N) each."""

    value: Any
    by_x: Any = None
    by_phase: Any = None


class ChartTable(NamedTuple):
    """Table of F functions of x in [-width, width] and a phase, over an interval or at E energies.

    At E energies the points to look up come in E groups; those of a group share an energy.
    """

    width: Any
    n_x: int
    n_phase: int
    values: Any
    """Coefficients (E, n_x n_phase, F), or (count, n_x n_phase, F) over an interval of energies.

    `count` is the number of Chebyshev polynomials of the energy; the phase runs faster than x."""
    counts: Any = None
    """Number of points of each group, if the groups are not all of one length."""

    def at(self, form: TorusForm) -> ChartTable:
        """The table at the energies of groups of points."""
        flat = self.values.reshape(len(self.values), -1)
        values = product(form.weights, flat).reshape(len(form.weights), *self.values.shape[1:])
        return self._replace(values=values, counts=form.counts)

    def look_up(self, x: Scalar, phase: Scalar, a: Precision) -> Any:
        """The functions at N points, (F, N)."""
        T = chebyshev_basis(x / self.width, self.n_x, a)
        return _summed(self._by_phase(T), fourier_basis(phase, self.n_phase, a))

    def look_up_slopes(self, x: Scalar, phase: Scalar, a: Precision) -> Looked:
        """The functions at N points, with their derivatives in x and in the phase."""
        share = x / self.width
        T, F = chebyshev_basis(share, self.n_x, a), fourier_basis(phase, self.n_phase, a)
        by_phase, by_x = self._by_phase(T), self._by_phase(chebyshev_slopes(T, share))
        values, slopes = _summed(by_phase, F), _summed(by_x, F) / self.width
        return Looked(values, slopes, _summed(by_phase, fourier_slopes(F)))

    def _by_phase(self, T: Any) -> Any:
        """The Fourier coefficients (N, n_phase, F) at points, from polynomials of x, T (N, n_x)."""
        values = self.values.reshape(len(self.values), self.n_x, -1)
        shape = len(T), self.n_phase, values.shape[-1] // self.n_phase
        return grouped(T, values, self.counts).reshape(shape)


def _summed(coefficients: Any, F: Any) -> Any:
    """The functions at points, (functions, N), from coefficients and the Fourier basis F (N, n)."""
    return np.matmul(F[:, None, :], coefficients)[:, 0].T


def fitted(
    values: Callable[[Any, Any, TorusForm], Any],
    width: Scalar,
    n_x: int,
    n_phase: int,
    nf: NormalForm,
    power: int,
    a: Precision,
) -> ChartTable:
    """The table of functions over |x| <= width, all phases and the normal form's energies.

    The terms of a table shrink with the sum of their orders in x, phase and energy. So the energy
    is interpolated by Newton's divided differences, each of which is a table over x and phase: the
    k-th of n differences takes a share of 1 - (k/n)^power of the nodes in each direction.

    ``values(x, phase, form)`` gives the functions, (F, N), at points in groups by energy; there
    are n_x n_phase nodes at the first energy, and fewer at each further one.
    """
    energies, order = nf.energies, _spread(nf.energies.n)
    at = nodes(energies.n, a)[order]
    # newton[i, k] is Newton's k-th polynomial at node i: the product of at[i] - at[j], j < k.
    newton = a.zeros((energies.n, energies.n))
    newton[:, 0] = a.number(1)
    for k in range(1, energies.n):
        newton[:, k] = newton[:, k - 1] * (at - at[k - 1])
    # All nodes of all energies, one energy after another, with the phase running fastest.
    sizes = table_sizes(n_x, n_phase, energies.n, power)
    x = np.concatenate([np.repeat(width * nodes(few_x, a), few) for few_x, few in sizes])
    phase = np.concatenate([np.tile(phases(few, a), few_x) for few_x, few in sizes])
    form = TorusForm(nf, energies.nodes(a)[order], a)
    blocks = in_blocks([few_x * few for few_x, few in sizes])
    found = [values(x[at], phase[at], form.part(levels, here)) for levels, at, here in blocks]
    value = np.concatenate(found, axis=1).T
    functions = value.shape[1]
    # found[k] holds the coefficients of the k-th divided difference, in x and in (phase, function).
    found = a.zeros((energies.n, n_x, n_phase * functions))
    for level, (few_x, few) in enumerate(sizes):
        own, value = value[: few_x * few].reshape(few_x, few, functions), value[few_x * few :]
        if level:
            # The k-th difference at its own, fewer nodes: the values less all lower differences.
            known = newton[level : level + 1, :level] @ found[:level].reshape(level, -1)
            known = chebyshev_synthesis(few_x, n_x, a) @ known.reshape(n_x, -1)
            known = known.reshape(few_x, n_phase, functions)
            known = np.matmul(fourier_synthesis(few, n_phase, a), known)
            own = (own - known) / newton[level, level]
        own = np.matmul(fourier_analysis(few, a), own).reshape(few_x, -1)
        found[level, :few_x, : few * functions] = chebyshev_analysis(few_x, a) @ own
    # From Newton's polynomials to Chebyshev's: both are known at the nodes in the same order.
    back = chebyshev_analysis(energies.n, a)[:, order] @ newton
    return ChartTable(
        width,
        n_x,
        n_phase,
        (back @ found.reshape(energies.n, -1)).reshape(energies.n, n_x * n_phase, functions),
    )


@functools.cache
def _spread(n: int) -> list[int]:
    """Leja's order of the Chebyshev nodes: each node is far from all before it.

    Divided differences then magnify roundings of values little: some 10 times with 12 nodes, where
    nodes in descending order would magnify them 6e4 times.
    """
    x, order = nodes(n, precision(53)), [0]
    for _ in range(1, n):
        order.append(int(np.abs(x[:, None] - x[order]).prod(axis=1).argmax()))
    return order


def table_sizes(n_x: int, n_phase: int, n: int, power: int) -> list[tuple[int, int]]:
    """The numbers of nodes in x and in phase of each of n divided differences of a table."""
    shares = [1 - (k / n) ** power for k in range(n)]
    # Phases are always odd in number, for the reason given in `expansions`.
    phases_ = [SPARE_PHASES + math.ceil(n_phase * share) // 2 * 2 + 1 for share in shares]
    return [
        (min(n_x, SPARE_X + math.ceil(n_x * share)), min(n_phase, few))
        for share, few in zip(shares, phases_, strict=True)
    ]


def section_chart(
    rising: bool,
    d: Scalar,
    chi: Scalar,
    form: TorusForm,
    c: Coefficients,
    length: Scalar,
) -> Any:
    """U, V, and the constants of time t' and theta3, at N points of the section: (4, N).

    The last row is left out where the normal form has no theta3. Upward (`rising`) crossings lie
    beside separatrix 2, downward ones beside 3. The arcs take the time `length`, t'.

    Raises
    ------
    MapError
        The arcs do not end within the range of the normal form.
    """
    nf, a, h = form.nf, form.a, np.repeat(form.h, form.group_sizes(len(d)))
    side, shares = 1 if rising else -1, a.zeros((0,))
    # theta3 is a quadrature along the arc, by Gauss's rule: its points come before the arc's end.
    if nf.theta3:
        few = quadrature_points(float(length), c, float(nf.energies.centre), a.bits)
        shares, parts = gauss(few, a)
    path, psi, at = arcs(rising, d, chi, form, c, length * np.append(shares, a.array([1.0])))
    turned = branch(psi - chi, side, length, h, c, a)
    rates = form.rates(at.u * at.v)
    # U = u exp(-Lambda turned), V = v exp(Lambda turned), t less what passes beside the orbit.
    stretch = a.exp(rates.exponent * turned)
    time = side * length - at.tau - rates.rotation * turned
    found = [at.u / stretch, at.v * stretch, time]
    if nf.theta3:
        rate = theta3_rate(path[:3, :-1], c)
        found.append(side * length * (parts[:, None] * rate).sum(axis=0) - at.sigma)
    return np.stack(found)


def arcs(
    rising: bool, d: Scalar, chi: Scalar, form: TorusForm, c: Coefficients, times: Scalar
) -> tuple[Any, Any, NormalPoint]:
    """The arcs from points of the section towards the periodic orbit, and where they end.

    They are the states at ascending `times` (t', not negative), forwards from upward (`rising`)
    crossings and backwards from downward ones, the phase psi at the last one, and u and v there.

    Raises
    ------
    MapError
        The arcs do not end within the range of the normal form.
    """
    a, h = form.a, np.repeat(form.h, form.group_sizes(len(d)))
    begin = section_state(rising, d, chi, h, c, a)
    path = states_at(c.aligned, begin, times if rising else -times, a.bits)
    end = path[:, -1]
    # Beside the upper orbit M3 is near +J2, whichever way the arc runs in time.
    if not (end[2] > 0).all():
        raise MapError("an orbit from the section does not reach the periodic orbit")
    psi = rotation_phase(end, c, a)
    return path, psi, form.inverted(psi, end[0], end[1])


def branch(
    turned: Scalar, side: int, length: Scalar, h: Scalar, c: Coefficients, a: Precision
) -> Any:
    """psi - chi at the end of arcs, radians: the value next to that of the motion without weight.

    `turned` is psi - chi up to whole turns, `length` the duration of the arcs, t'.
    """
    # With psi and chi as theta1 and theta2 give them, psi - chi is alpha0/2 - pi on separatrix 2
    # and -alpha0/2 on 3, and grows by kappa J2 in a unit of time.
    alpha0 = 2 * a.atan2(1 / c.to_M2, 1 / c.to_M1)
    free = side * (alpha0 / 2 + c.aligned.kappa * a.sqrt(2 * h / c.aligned.kappa) * length)
    free = free - (a.pi if side > 0 else 0)
    return free + a.atan2(a.sin(turned - free), a.cos(turned - free))


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
    rising: bool,
    width: Scalar,
    n_x: int,
    n_phase: int,
    nf: NormalForm,
    c: Coefficients,
    length: Scalar,
    a: Precision,
) -> ChartTable:
    """The chart of a section as a table over |d| <= width."""

    def chart(d: Any, chi: Any, form: TorusForm) -> Any:
        return section_chart(rising, d, chi, form, c, length)

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
    begin, slopes, at = _newton(rising, low, form.in_doubles(series=False), rough)
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
