"""Charts: from the section M3 = 0 to the normal form, and back, as tables.

From nodes on the section short arcs lead to the upper periodic orbit: forward in time from
upward crossings, backward from downward ones. There the normal form is solved for u, v. Then

    U = u exp(-Lambda(I) (psi - chi)),    V = v exp(Lambda(I) (psi - chi)),
    t - tau - (dt/dpsi) (psi - chi),      theta3 - sigma

are the same wherever along the arc they are taken: functions of (d, chi) alone, smooth in d and
periodic in chi. So a table of few Chebyshev polynomials and Fourier modes holds them.

The inverse charts give (d, chi - s) and the same times as functions of I = U V and of
s = chi - ln(U)/Lambda(I) (downward) or chi + ln(V)/Lambda(I) (upward), which no passage changes.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.conjugacy import Beside, TorusForm, TorusRates
from rigidpend.orbits.return_map.expansions import (
    chebyshev_analysis,
    chebyshev_basis,
    chebyshev_synthesis,
    fourier_analysis,
    fourier_basis,
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
SETTLED = 1e-12
"""Correction in doubles, relative, after which the next one would be rounding."""
UNCOVERED = "the charts of the section do not cover the invariants' range"
STRIP = 1.2
"""Distance of the nearest complex singularity of theta3's rate from the arc's middle.

In units of 1/Lambda_0, as it is taken to be; it is pi/2 without weight."""
FORWARD, INVERSE = 1, 3
"""Powers by which the orders of charts and of inverse charts shrink from energy to energy."""
SPARE_X, SPARE_PHASES = 1, 2
"""Nodes that a difference between energies takes beyond its share."""


class Looked(NamedTuple):
    """The F functions of a table, and their derivatives where they are asked for, (F, N) each."""

    value: Any
    by_x: Any = None
    by_phase: Any = None


class ChartTable(NamedTuple):
    """Functions of x in [-width, width] and a phase, F of them, over energies or at E of them.

    Points to look them up at come in E groups, each with an energy in common.
    """

    width: Any
    n_x: int
    n_phase: int
    values: Any
    """(E, n_x n_phase, F) coefficients, or (count, ...) over energies; the phase runs fastest."""
    counts: Any = None
    """Points of each group, where these are not all of one length."""

    def at(self, form: TorusForm) -> ChartTable:
        """The table at the energies of groups of points."""
        flat = self.values.reshape(len(self.values), -1)
        values = product(form.weights, flat).reshape(len(form.weights), *self.values.shape[1:])
        return self._replace(values=values, counts=form.counts)

    def look_up(self, x: Scalar, phase: Scalar, a: Precision) -> Any:
        """The functions at points, (F, N)."""
        T = chebyshev_basis(x / self.width, self.n_x, a)
        return _summed(self._by_phase(T), fourier_basis(phase, self.n_phase, a))

    def look_up_slopes(self, x: Scalar, phase: Scalar, a: Precision) -> Looked:
        """The functions at points, with the derivatives."""
        by_phase, by_x = (
            self._by_phase(chebyshev_basis(x / self.width, self.n_x, a, slope=slope))
            for slope in (False, True)
        )
        F, dF = (fourier_basis(phase, self.n_phase, a, slope=slope) for slope in (False, True))
        return Looked(_summed(by_phase, F), _summed(by_x, F) / self.width, _summed(by_phase, dF))

    def _by_phase(self, T: Any) -> Any:
        """The Fourier coefficients (N, n_phase, F) where polynomials of x are (N, n_x)."""
        values = self.values.reshape(len(self.values), self.n_x, -1)
        shape = len(T), self.n_phase, values.shape[-1] // self.n_phase
        return grouped(T, values, self.counts).reshape(shape)


def _summed(coefficients: Any, F: Any) -> Any:
    """The functions (F, N) from Fourier coefficients (N, n, F) at points."""
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
    """The table of some functions over |x| <= width.

    Its terms shrink with the sum of their orders. So Newton's divided differences from energy to
    energy are tables that take the fewer nodes the higher they are: of the k-th of n a share of
    1 - (k/n)^power in each direction.

    ``values(x, phase, form)`` gives the functions, (F, N), at points in groups by energies; there
    are n_x n_phase nodes at the first energy.
    """
    energies, order = nf.energies, _spread(nf.energies.n)
    at = nodes(energies.n, a)[order]
    newton = a.zeros((energies.n, energies.n))
    newton[:, 0] = a.number(1)
    for k in range(1, energies.n):
        newton[:, k] = newton[:, k - 1] * (at - at[k - 1])
    sizes = table_sizes(n_x, n_phase, energies.n, power)
    x = np.concatenate([np.repeat(width * nodes(few_x, a), few) for few_x, few in sizes])
    phase = np.concatenate([np.tile(phases(few, a), few_x) for few_x, few in sizes])
    form = TorusForm(nf, energies.nodes(a)[order], a)
    blocks = in_blocks([few_x * few for few_x, few in sizes])
    found = [values(x[at], phase[at], form.part(levels, here)) for levels, at, here in blocks]
    value = np.concatenate(found, axis=1).T
    functions = value.shape[1]
    found = a.zeros((energies.n, n_x, n_phase * functions))
    for level, (few_x, few) in enumerate(sizes):
        own, value = value[: few_x * few].reshape(few_x, few, functions), value[few_x * few :]
        if level:
            known = newton[level : level + 1, :level] @ found[:level].reshape(level, -1)
            known = chebyshev_synthesis(few_x, n_x, a) @ known.reshape(n_x, -1)
            known = known.reshape(few_x, n_phase, functions)
            known = np.matmul(fourier_synthesis(few, n_phase, a), known)
            own = (own - known) / newton[level, level]
        own = np.matmul(fourier_analysis(few, a), own).reshape(few_x, -1)
        found[level, :few_x, : few * functions] = chebyshev_analysis(few_x, a) @ own
    back = chebyshev_analysis(energies.n, a)[:, order] @ newton
    return ChartTable(
        width,
        n_x,
        n_phase,
        (back @ found.reshape(energies.n, -1)).reshape(energies.n, n_x * n_phase, functions),
    )


@functools.cache
def _spread(n: int) -> list[int]:
    """The order of Chebyshev nodes in which each is far from those before it (Leja's)."""
    x, order = nodes(n, precision(53)), [0]
    for _ in range(1, n):
        order.append(int(np.abs(x[:, None] - x[order]).prod(axis=1).argmax()))
    return order


def table_sizes(n_x: int, n_phase: int, n: int, power: int) -> list[tuple[int, int]]:
    """The nodes in x and in phase of each of n divided differences of a table."""
    shares = [1 - (k / n) ** power for k in range(n)]
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
    """U, V, and the constants of time and theta3, at points of the section: (4, N).

    The last is left out where the normal form tells no theta3. Upward (`rising`) crossings are
    those of separatrix 2, downward ones of 3; the arcs take the time `length`, t'.

    Raises
    ------
    MapError
        The arcs do not end within the range of the normal form.
    """
    nf, a, h = form.nf, form.a, np.repeat(form.h, form.each(len(d)))
    side, shares = 1 if rising else -1, a.zeros((0,))
    if nf.theta3:
        few = quadrature_points(float(length), c, float(nf.energies.centre), a.bits)
        shares, parts = gauss(few, a)
    path, psi, at = arcs(rising, d, chi, form, c, length * np.append(shares, a.array([1.0])))
    turned = branch(psi - chi, side, length, h, c, a)
    rates = form.rates(at.u * at.v)
    stretch = a.exp(rates.exponent * turned)
    time = side * length - at.tau - rates.rotation * turned
    found = [at.u / stretch, at.v * stretch, time]
    if nf.theta3:
        rate = theta3_rate(path[:3, :-1], c)
        found.append(side * length * (parts[:, None] * rate).sum(axis=0) - at.sigma)
    return np.stack(found)


def arcs(
    rising: bool, d: Scalar, chi: Scalar, form: TorusForm, c: Coefficients, times: Scalar
) -> tuple[Any, Any, Beside]:
    """The arcs from points of the section towards the periodic orbit, and where they end.

    They are the states at ascending `times` (t', not negative), forwards from upward (`rising`)
    crossings and backwards from downward ones, the phase psi at the last one, and u and v there.

    Raises
    ------
    MapError
        The arcs do not end within the range of the normal form.
    """
    a, h = form.a, np.repeat(form.h, form.each(len(d)))
    begin = section_state(rising, d, chi, h, c, a)
    path = states_at(c.aligned, begin, times if rising else -times, a.bits)
    end = path[:, -1]
    if not (end[2] > 0).all():
        raise MapError("an orbit from the section does not reach the periodic orbit")
    psi = rotation_phase(end, c, a)
    return path, psi, form.inverted(psi, end[0], end[1])


def branch(
    turned: Scalar, side: int, length: Scalar, h: Scalar, c: Coefficients, a: Precision
) -> Any:
    """psi - chi, next to what it is without weight."""
    alpha0 = 2 * a.atan2(1 / c.to_M2, 1 / c.to_M1)
    free = side * (alpha0 / 2 + c.aligned.kappa * a.sqrt(2 * h / c.aligned.kappa) * length)
    free = free - (a.pi if side > 0 else 0)
    return free + a.atan2(a.sin(turned - free), a.cos(turned - free))


def quadrature_points(length: float, c: Coefficients, h: float, bits: int) -> int:
    """The number of points at which theta3's rate is summed along an arc."""
    k = c.aligned
    J2 = math.sqrt(2 * h / float(k.kappa))
    weight = math.hypot(float(k.mu_r1), float(k.mu_r2)) / h
    # In complex time the weight's share grows with the rotation, up to order one.
    height = min(STRIP / (float(k.half_sigma) * J2), -math.log(weight) / (float(k.kappa) * J2))
    return math.ceil(bits * math.log(2) / 2 / math.asinh(height * 2 / length))


class Chart(NamedTuple):
    """The chart of one section, both ways: tables over energies, or at some."""

    forward: ChartTable
    """U, V, and the constants of time and theta3, of (d, chi)."""
    inverse: ChartTable
    """d, chi - s, and the same constants, of (I, s)."""

    def at(self, form: TorusForm) -> Chart:
        """Both at the energies of groups of points."""
        return Chart(self.forward.at(form), self.inverse.at(form))


Charts: TypeAlias = tuple[Chart, Chart]
"""The charts of downward and of upward crossings."""


class Invariants(NamedTuple):
    """I and s, which no passage changes, with the rates on the torus; (N,) each."""

    I: Any
    s: Any
    rates: TorusRates
    by_d: Any = None
    """Derivatives of I and s in d, where they are asked for."""
    by_chi: Any = None
    """The same in chi."""


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

    return fitted(chart, width, n_x, n_phase, nf, FORWARD, a)


def inverse_table(
    rising: bool, forward: ChartTable, width: Scalar, n_phase: int, nf: NormalForm, a: Precision
) -> ChartTable:
    """The inverse chart as a table over |I| <= width, from the chart's table.

    Raises
    ------
    MapError
        The invariants don't belong to points of the section within the chart.
    """

    def chart(I: Any, s: Any, form: TorusForm) -> Any:
        d, chi, value = _solved(rising, forward.at(form), form, (I, s))
        return np.stack((d, chi - s, *value[2:]))

    return fitted(chart, width, forward.n_x, n_phase, nf, INVERSE, a)


def _solved(
    rising: bool, forward: ChartTable, form: TorusForm, goal: tuple[Scalar, Scalar]
) -> tuple[Any, Any, Any]:
    """The points (d, chi) that have the invariants I and s, and the chart there.

    Doubles do all of it but the last corrections, and give the slopes for these.
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
        # The slopes in doubles leave 2^-40 of a correction.
        if _size(step, turn, low, a) * 2.0**-40 < a.epsilon:
            return d, chi, value - slopes.by_x * step - slopes.by_phase * turn
    raise MapError(UNCOVERED)


def _newton(
    rising: bool, table: ChartTable, form: TorusForm, goal: tuple[Any, Any]
) -> tuple[tuple[Any, Any], Looked, Invariants]:
    """The points in doubles, with the chart and the invariants there."""
    a = form.a
    d, chi = 0 * goal[0], goal[1] + 0
    # Where passages are long chi and s are many turns apart, the same at nearly all points.
    begun = Looked(table.look_up(d, chi, a))
    chi = chi - (invariants(rising, begun, chi, form).s - goal[1])
    for _ in range(MOST_ITERATIONS):
        seen = table.look_up_slopes(d, chi, a)
        at = invariants(rising, seen, chi, form)
        step, turn = correction(at.by_d, at.by_chi, (at.I - goal[0], at.s - goal[1]))
        d, chi = np.clip(d - step, -2 * table.width, 2 * table.width), chi - turn
        if _size(step, turn, table, a) < SETTLED:
            if a.largest(d) <= table.width:
                return (d, chi), seen, at
            break
    raise MapError(UNCOVERED)


def _size(step: Any, turn: Any, table: ChartTable, a: Precision) -> float:
    return a.largest(step) / float(table.width) + a.largest(turn)


def invariants(by_v: bool, seen: Looked, chi: Scalar, form: TorusForm) -> Invariants:
    """I and s of points of a section, with their derivatives in (d, chi) if the chart has some.

    By V s is chi + ln|V|/Lambda, as for upward crossings, and else chi - ln|U|/Lambda.
    """
    (U, V), which, side = seen.value[:2], int(by_v), 1 if by_v else -1
    I, W = U * V, seen.value[which]
    rates = form.rates(I)
    depth = form.a.log(np.abs(W)) / rates.exponent
    s = chi + depth if by_v else chi - depth
    if seen.by_x is None:
        return Invariants(I, s, rates)
    slopes, depth = [], s - chi
    for own, by in enumerate((seen.by_x, seen.by_phase)):
        of_I = U * by[1] + V * by[0]
        of_depth = side * by[which] / W - depth * rates.exponent_slope * of_I
        slopes.append((of_I, own + of_depth / rates.exponent))
    return Invariants(I, s, rates, *slopes)
