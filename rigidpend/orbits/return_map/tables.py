"""Tables of functions of x, a phase and the energy: fitted at nodes, and looked up."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers import Scalar
from rigidpend.orbits.precision import Precision, precision, product
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import (
    chebyshev_analysis,
    chebyshev_basis,
    chebyshev_slopes,
    chebyshev_synthesis,
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
    are n_x n_phase nodes at the first energy, and fewer at each further one. Those of a phase
    follow each other, which `form` tells.
    """
    energies, order = nf.energies, _spread(nf.energies.n)
    at = nodes(energies.n, a)[order]
    # newton[i, k] is Newton's k-th polynomial at node i: the product of at[i] - at[j], j < k.
    newton = a.zeros((energies.n, energies.n))
    newton[:, 0] = a.number(1)
    for k in range(1, energies.n):
        newton[:, k] = newton[:, k - 1] * (at - at[k - 1])
    # All nodes of all energies, one energy after another, with x running fastest.
    sizes = table_sizes(n_x, n_phase, energies.n, power)
    x = np.concatenate([np.tile(width * nodes(few_x, a), few) for few_x, few in sizes])
    phase = np.concatenate([np.repeat(phases(few, a), few_x) for few_x, few in sizes])
    counts, shared = [few_x * few for few_x, few in sizes], [few_x for few_x, _ in sizes]
    form = TorusForm(nf, energies.nodes(a)[order], a, counts, shared=shared)
    blocks = in_blocks(counts, shared=shared)
    made = [values(x[at], phase[at], form.part(levels, here)) for levels, at, here in blocks]
    value = np.concatenate(made, axis=1).T
    functions = value.shape[1]
    # found[k] holds the coefficients of the k-th divided difference, in x and in (phase, function).
    found = a.zeros((energies.n, n_x, n_phase * functions))
    for level, (few_x, few) in enumerate(sizes):
        own = value[: few_x * few].reshape(few, few_x, functions).transpose(1, 0, 2)
        value = value[few_x * few :]
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
