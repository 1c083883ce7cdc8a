"""Tables of functions of x, a phase and the energy: fitted at nodes, and looked up."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from operator import mul
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.numbers import Scalar
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import (
    MOST_KEPT,
    chebyshev_analysis,
    chebyshev_basis,
    chebyshev_slopes,
    fourier_analysis,
    fourier_basis,
    fourier_slopes,
    fourier_synthesis,
    grouped,
    in_blocks,
    nodes,
    phases,
)
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.precision import Precision, precision, product

FORWARD, INVERSE = (1, 0.6), (3, 1.0)
"""Rules by which a table's nodes become fewer: of charts, and of inverse charts (:func:`fitted`).

First the power by which orders shrink with the energy's order, then the share of the phases that
the later half of the places in x takes. With a share of 0.5 charts of four bodies with weights of
0.006 h to 0.018 h, whose terms shrink less with the sum of their orders, erred 5 to 60 times as
much; with 0.6 by no more than with all phases. In inverse charts it would save little time, and
where they err most lies between the points that measure it."""
SPARE_X, SPARE_PHASES = 1, 2
"""Further nodes in x and in phase, beyond its share, of each divided difference in the energy."""
LEAST_DIVIDED = 4
"""Least number of places in x that are divided into halves."""


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
    fewer: tuple[int, float],
    a: Precision,
) -> ChartTable:
    """The table of functions over |x| <= width, all phases and the normal form's energies.

    The terms of a table shrink with the sum of their orders in x, phase and energy. So the energy
    is interpolated by Newton's divided differences, each of which is a table over x and phase: the
    k-th of n differences takes a share of 1 - (k/n)^power of the nodes in each direction. Within
    one of them the places in x are in Leja's order, and the later half of them takes fewer phases:
    their higher harmonics follow from those of the first half. `fewer` says how many, as `FORWARD`.

    ``values(x, phase, form)`` gives the functions, (F, N), at points in groups by energy. Those of
    a phase follow each other, which `form` tells.
    """
    energies, order = nf.energies, _spread(nf.energies.n)
    at = nodes(energies.n, a)[order]
    # newton[i, k] is Newton's k-th polynomial at node i: the product of at[i] - at[j], j < k.
    newton = a.zeros((energies.n, energies.n))
    newton[:, 0] = a.number(1)
    for k in range(1, energies.n):
        newton[:, k] = newton[:, k - 1] * (at - at[k - 1])
    # All nodes of all energies, one energy after another, with x running fastest.
    sizes = table_sizes(n_x, n_phase, energies.n, fewer)
    xs, phases_, shared = list[Any](), list[Any](), list[int]()
    for level in sizes:
        places, begin = width * _places(_count(level), a), 0
        for few_x, few in level:
            xs.append(np.tile(places[begin : begin + few_x], few))
            phases_.append(np.repeat(phases(few, a), few_x))
            shared += [few_x] * few
            begin += few_x
    x, phase = np.concatenate(xs), np.concatenate(phases_)
    counts = [sum(few_x * few for few_x, few in level) for level in sizes]
    form = TorusForm(nf, energies.nodes(a)[order], a, counts, shared=shared)
    made = [
        values(x[at], phase[at], form.part(levels, here, together))
        for levels, at, here, together in in_blocks(counts, shared=shared)
    ]
    value = np.concatenate(made, axis=1).T
    functions = value.shape[1]
    # found[k] holds the coefficients of the k-th divided difference, in x and in (phase, function).
    found = a.zeros((energies.n, n_x, n_phase * functions))
    for k, level in enumerate(sizes):
        few_x, few = _count(level), level[0][1]
        own, value = value[: counts[k]], value[counts[k] :]
        if k:
            # The k-th difference at its own, fewer nodes: the values less all lower differences.
            known = (newton[k : k + 1, :k] @ found[:k].reshape(k, -1)).reshape(n_x, -1)
            known = chebyshev_basis(_places(few_x, a), n_x, a) @ known
            own = own - _values(known.reshape(few_x, n_phase, functions), level, a)
            own = own / newton[k, k]
        own = _by_node(own, level, a).reshape(few_x, -1)
        own = chebyshev_analysis(few_x, a)[:, _spread(few_x)] @ own
        found[k, :few_x, : few * functions] = own
    # From Newton's polynomials to Chebyshev's: both are known at the nodes in the same order.
    back = chebyshev_analysis(energies.n, a)[:, order] @ newton
    return ChartTable(
        width,
        n_x,
        n_phase,
        (back @ found.reshape(energies.n, -1)).reshape(energies.n, n_x * n_phase, functions),
    )


def _values(coefficients: Any, level: Level, a: Precision) -> Any:
    """The values (points, F) at a level's nodes from Fourier coefficients (x, phase, F) there."""
    found, begin = [], 0
    for few_x, few in level:
        own = coefficients[begin : begin + few_x]
        own = np.matmul(fourier_synthesis(few, own.shape[1], a), own)
        found.append(own.transpose(1, 0, 2).reshape(few_x * few, -1))
        begin += few_x
    return np.concatenate(found)


def _by_node(values: Any, level: Level, a: Precision) -> Any:
    """The Fourier coefficients (x, phase, F) at a level's nodes in x, from values (points, F)."""
    most, functions, begin, point = level[0][1], values.shape[1], 0, 0
    found = a.zeros((_count(level), most, functions))
    for few_x, few in level:
        end, last = begin + few_x, point + few_x * few
        own = values[point:last].reshape(few, few_x, functions).transpose(1, 0, 2)
        if few < most:
            # Harmonics that so few phases cannot tell apart from lower ones are taken off first.
            higher = _further(_count(level), begin, end, a) @ found[:begin, few:].reshape(begin, -1)
            found[begin:end, few:] = higher = higher.reshape(few_x, most - few, functions)
            own = own - np.matmul(fourier_synthesis(few, most, a)[:, few:], higher)
        found[begin:end, :few] = np.matmul(fourier_analysis(few, a), own)
        begin, point = end, last
    return found


@functools.lru_cache(maxsize=MOST_KEPT)
def _further(n: int, begin: int, end: int, a: Precision) -> Any:
    """The matrix from a polynomial's values at the first of n places to those at the next ones.

    There are `begin` of the first, and those of the next are numbered up to `end`.
    """
    places = _places(n, a)
    known, apart = places[:begin], places[begin:end, None] - places[:begin]
    # Lagrange's polynomials, as the product of all distances over the one left out; the products of
    # the distances of one known place from the others have 1 in the place of its own.
    among = known[:, None] - known + a.array(np.eye(begin))
    every, own = (functools.reduce(mul, x.T) for x in (apart, among))
    return every[:, None] / apart / own


@functools.lru_cache(maxsize=MOST_KEPT)
def _places(n: int, a: Precision) -> Any:
    """The n Chebyshev nodes in Leja's order."""
    return nodes(n, a)[_spread(n)]


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


Level: TypeAlias = list[tuple[int, int]]
"""Nodes of a divided difference: numbers of successive places in x, and of the phases of each."""


def _count(level: Level) -> int:
    """The number of places in x of a divided difference."""
    return sum(few_x for few_x, _ in level)


def table_sizes(n_x: int, n_phase: int, n: int, fewer: tuple[int, float]) -> list[Level]:
    """The numbers of nodes in x and in phase of each of n divided differences of a table."""
    (power, later_phases), found = fewer, []
    for k in range(n):
        share = 1 - (k / n) ** power
        few_x = min(n_x, SPARE_X + math.ceil(n_x * share))
        few = min(n_phase, SPARE_PHASES + _phases(n_phase, share))
        later = few_x // 2 if few_x >= LEAST_DIVIDED and later_phases < 1 else 0
        halves = (few_x - later, few), (later, min(few, _phases(few, later_phases)))
        found.append([half for half in halves if half[0]])
    return found


def _phases(n: int, share: float) -> int:
    """The number of phases for a share of n: always odd, for the reason given in `expansions`."""
    return math.ceil(n * share) // 2 * 2 + 1
