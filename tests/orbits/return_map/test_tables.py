"""Tables: functions of a place, a phase and the energy, from few of their values."""

from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.orbits.return_map import tables
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import Interval, chebyshev_basis
from rigidpend.orbits.return_map.precision import Precision, precision
from rigidpend.orbits.return_map.tables import FORWARD, INVERSE, fitted, table_sizes

WIDTH, N_X, N_PHASE, ENERGIES = 0.25, 9, 15, 5


@pytest.mark.parametrize(
    ("n_x", "n_phase", "sizes"),
    [
        (3, 31, [(3, 31)]),
        (4, 31, [(2, 31), (2, 19)]),
        (9, 15, [(5, 15), (4, 9)]),
        (9, 3, [(5, 3), (4, 3)]),
        (9, 1, [(5, 1), (4, 1)]),
    ],
)
def test_the_later_half_of_the_places_takes_three_fifths_of_the_phases(
    n_x: int, n_phase: int, sizes: list[tuple[int, int]]
) -> None:
    assert table_sizes(n_x, n_phase, 1, FORWARD) == [sizes]
    assert table_sizes(n_x, n_phase, 1, INVERSE) == [[(n_x, n_phase)]]


def test_orders_shrink_with_that_of_the_energy() -> None:
    charts, inverses = (table_sizes(N_X, N_PHASE, 2, fewer)[1] for fewer in (FORWARD, INVERSE))
    assert charts == [(3, 11), (3, 7)]
    assert inverses == [(9, 15)]


def tabulated(terms: list[tuple[int, int, int]], a: Precision) -> tuple[float, int]:
    """The largest error of the table of a function beside its nodes, and the number of nodes.

    It has two functions, which at terms (i, j, k) are T_i(x) cos(j phase + 1) e^k and half of it.
    """
    energies = Interval(a.number(2), a.number(0.5), ENERGIES)
    seen = []

    def values(x: Any, phase: Any, form: TorusForm) -> Any:
        seen.append(len(x))
        e = (np.repeat(form.h, form.group_sizes(len(x))) - energies.centre) / energies.half_width
        T = chebyshev_basis(x / WIDTH, N_X, a)
        one: Any = sum(T[:, i] * a.cos(j * phase + 1) * e**k for i, j, k in terms)
        return np.stack([one, one / 2])

    form: Any = Mock(energies=energies)
    table = fitted(values, a.number(WIDTH), N_X, N_PHASE, form, FORWARD, a)
    nodes = sum(seen)
    h, random = a.array([1.6, 2.3]), np.random.default_rng(1)
    at = TorusForm(form, h, a, [20, 20])
    x, phase = a.array(random.uniform(-WIDTH, WIDTH, 40)), a.array(random.uniform(0, 6.28, 40))
    off = table.at(at).look_up(x, phase, a) - values(x, phase, at)
    return a.largest(off), nodes


# First and last places, harmonics and energies: (order in x, harmonic, order in the energy).
HELD = [(4, 7, 0), (8, 4, 0), (0, 0, 4), (2, 5, 1), (5, 3, 1), (0, 3, 3), (1, 2, 3)]


@pytest.mark.parametrize("bits", [53, 90])
def test_a_table_holds_terms_up_to_their_orders_to_rounding(bits: int) -> None:
    a = precision(bits)
    off, nodes = tabulated(HELD, a)
    assert off < 1e3 * a.epsilon
    assert nodes == sum(
        m * n for level in table_sizes(N_X, N_PHASE, ENERGIES, FORWARD) for m, n in level
    )


@pytest.mark.parametrize("term", [(5, 7, 0), (8, 5, 0), (0, 8, 0), (0, 7, 4)])
def test_a_table_does_not_hold_a_term_beyond(term: tuple[int, int, int]) -> None:
    """Otherwise it would have taken more nodes than it has."""
    assert tabulated([term], precision(53))[0] > 0.1


def test_a_table_that_is_not_divided_takes_more_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    a = precision(53)
    divided = tabulated(HELD, a)[1]
    monkeypatch.setattr(tables, "LEAST_DIVIDED", N_X + 1)
    off, whole = tabulated([*HELD, (8, 7, 0)], a)
    assert off < 1e3 * a.epsilon
    assert divided < 0.85 * whole
