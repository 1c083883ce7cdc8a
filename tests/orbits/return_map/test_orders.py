"""Orders of series: raised where errors tell them to be too small, their cost, and energies."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from rigidpend.numbers.exact import exact
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map.build import FIRST, WITH_THETA3, expected_cost
from rigidpend.orbits.return_map.checks import Errors
from rigidpend.orbits.return_map.looks import Rough, Shrinking
from rigidpend.orbits.return_map.midline import Layer
from rigidpend.orbits.return_map.orders import Orders, building_seconds, energy_nodes, orders
from rigidpend.orbits.return_map.reduced import coefficients
from tests.bodies import FIG4

ALLOWED = 2.0**-64


@pytest.mark.parametrize(
    ("charts", "inverse", "tails", "expected"),
    [
        # In units of what is allowed; tails of a 512th ask for more terms, and tell of errors twice
        # as large.
        (1.99, 0, (0, 1, 0), (21, 31, 11, 51, 63, 6)),
        (1.99, 0, (1, 0, 1), (21, 31, 14, 41, 51, 8)),
        (0, 0, (0.00196, 0.00195, 0), (21, 31, 14, 41, 51, 6)),
        (0, 0, (0, 0, 0.00196), (21, 31, 11, 41, 51, 8)),
        (0, 0.51, (0.00196, 0, 0), (21, 31, 14, 51, 63, 8)),
        (0, 0.49, (0.00196, 0, 0), (21, 31, 14, 41, 51, 6)),
        (0, 2.01, (1, 0, 0), (21, 31, 14, 51, 63, 8)),
        (0, 1.99, (1, 0, 0), (21, 31, 14, 41, 51, 6)),
        (2.01, 0, (0, 1, 0), (23, 33, 11, 51, 63, 6)),
        (1e6, 0, (0, 0, 0.00195), (27, 39, 11, 41, 51, 6)),
        (0, 0, (0, 0, 0), (23, 33, 11, 41, 51, 6)),
    ],
)
def test_orders_that_errors_tell_to_be_too_small_are_raised_by_a_fifth(
    charts: float, inverse: float, tails: tuple[float, ...], expected: tuple[int, ...]
) -> None:
    """Those of the normal form by as many degrees as the error asks for; phases to odd numbers."""
    errors = Errors(*(x * ALLOWED for x in (0, 0, charts, inverse, *tails)))
    assert Orders(21, 31, 11, 41, 51, 6, 2.5).larger(errors, ALLOWED) == (*expected, 2.5)


def test_a_map_of_one_energy_has_no_more_nodes_in_another_attempt() -> None:
    unexplained = Errors(0, 0, 0, ALLOWED, 0, 0, 0)
    assert Orders(21, 31, 11, 41, 51, 1, 2.5).larger(unexplained, ALLOWED).n_energy == 1


@pytest.mark.parametrize(("energies", "more"), [(6, 8), (1, 1)])
def test_a_design_has_so_many_terms_more_and_arcs_in_its_own_unit(energies: int, more: int) -> None:
    """At one energy there is nothing to add."""
    found = Orders(21, 31, 11, 41, 51, energies, 2.5).designed(0.5, 1.25, 4)
    assert found == (25, 35, 13, 45, 55, more, 6.25)


def falling(rate: float) -> Any:
    return np.exp(-rate * np.arange(30))


@pytest.mark.parametrize("slow", range(4))
def test_orders_are_those_of_the_table_that_shrinks_slowest(slow: int) -> None:
    """Charts are tables 0 and 2, and inverse charts 1 and 3."""
    rough = Rough(coefficients(FIG4.angles(), "1", precision(53)), 1.3342)
    rates = [0.5 if k == slow else 2.0 for k in range(4)]
    each = tuple(map(falling, rates))
    seen = Shrinking(falling(1.0), each, each, 1.0)
    layer = Layer(1e-6, (1e-4, 2e-4))
    found = orders(rough, 0.0, layer, seen, math.exp(-20), math.exp(-12))
    assert (found.degree, found.n_x, found.n_energy) == (25, 40, 1)
    few, many = 10, 40
    chart, inverse = (many if slow % 2 == k else few for k in (0, 1))
    assert (found.n_phase, found.n_phase_inverse) == (2 * chart + 1, 2 * inverse - 1)
    assert found.length == rough.arc_length(2e-4)
    # Over an interval of energies there are terms of several orders together: 40^3/1200 nodes more.
    wide = orders(rough, 0.001, layer, seen, math.exp(-20), math.exp(-12))
    assert wide == found._replace(n_x=40 + 53, n_energy=wide.n_energy)


def test_the_largest_error_is_that_of_exponents_of_charts_or_of_their_inverse() -> None:
    assert [Errors(*row).largest for row in np.eye(7)] == [1, 0, 1, 1, 0, 0, 0]


@pytest.mark.parametrize("name", Orders._fields)
def test_a_map_of_larger_orders_costs_more(name: str) -> None:
    """And not more than the largest power of them in the number of operations."""
    rough = Rough(coefficients(FIG4.angles(), "1", precision(53)), 1.3342)
    orders = Orders(21, 31, 20, 81, 91, 5, 2.5)
    twice, of = orders._replace(**{name: 2 * getattr(orders, name)}), [precision(53)] * 2
    once, more = (building_seconds(rough, x, *of, theta3=True) for x in (orders, twice))
    assert 1 < more / once < 8
    # Where charts cost little a normal form costs as the cube of its degree.
    forms = (Orders(n, 99, 2, 3, 3, 9, 2.5) for n in (400, 800))
    few, many = (building_seconds(rough, x, *of, theta3=False) for x in forms)
    assert 7.5 < many / few < 8.2


def test_a_map_is_expected_to_cost_more_in_more_bits_and_with_theta3() -> None:
    h, ends = exact("1.3342"), (exact("1.3332"), exact("1.3352"))
    # Over an interval of energies, so that the tables take most of the time.
    short, whole = (expected_cost(FIG4, *ends, 64, design) for design in (FIRST, WITH_THETA3))
    assert 0.4 < short / whole < 0.85
    costs = [expected_cost(FIG4, h, h, bits, FIRST) for bits in (53, 64, 96, 97, 113)]
    assert costs == sorted(costs)
    assert costs[2] < 4 * costs[0]
    # Beyond pairs of doubles the numbers are mpmath's: measured were 23 s in 97 bits, 49 s in 113.
    assert 10 < costs[3] < costs[4] < 50


@pytest.mark.parametrize("exponent", [0.01, 0.0463, 0.2, 1.0])
@pytest.mark.parametrize("distance", [3.0, 100.0, 1e5])
@pytest.mark.parametrize("nats", [36.0, 68.0])
def test_nodes_of_the_energy_are_those_of_the_best_circle(
    exponent: float, distance: float, nats: float
) -> None:
    """Each circle around the interval, up to one through the energy 0, bounds the error."""
    share = np.linspace(1e-4, 1, 100_000)[1:-1]
    growth, gained = np.arcsin(share) / exponent, np.log(2 * share * distance)
    fewest = next(n for n in itertools.count(1) if (growth - n * gained).min() < -nats)
    assert energy_nodes(exponent, distance, nats) == fewest
