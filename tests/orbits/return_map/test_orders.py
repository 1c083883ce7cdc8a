"""Orders of series: raised where errors tell them to be too small, their cost, and energies."""

import itertools

import numpy as np
import pytest

from rigidpend.numbers.exact import exact
from rigidpend.orbits.return_map.build import FIRST, WITH_THETA3, expected_cost
from rigidpend.orbits.return_map.checks import Errors
from rigidpend.orbits.return_map.looks import Rough
from rigidpend.orbits.return_map.orders import Orders, building_seconds, energy_nodes
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import coefficients
from tests.bodies import FIG4

ALLOWED = 2.0**-64


@pytest.mark.parametrize(
    ("charts", "inverse", "tails", "expected"),
    [
        # In units of what is allowed; what the tails tell is twice their largest.
        (1.99, 0, (0, 1, 0), (21, 31, 10, 51, 63, 5)),
        (1.99, 0, (1, 0, 1), (21, 31, 12, 41, 51, 6)),
        (0, 0, (0.13, 0.12, 0), (21, 31, 12, 41, 51, 5)),
        (0, 0.51, (0.13, 0, 0), (21, 31, 12, 51, 63, 6)),
        (0, 0.49, (0.13, 0, 0), (21, 31, 12, 41, 51, 5)),
        (0, 2.01, (1, 0, 0), (21, 31, 12, 51, 63, 6)),
        (0, 1.99, (1, 0, 0), (21, 31, 12, 41, 51, 5)),
        (2.01, 0, (0, 1, 0), (23, 33, 10, 51, 63, 5)),
        (1e6, 0, (0, 0, 0.12), (27, 39, 10, 41, 51, 5)),
        (0, 0, (0, 0, 0), (23, 33, 10, 41, 51, 5)),
    ],
)
def test_orders_that_errors_tell_to_be_too_small_are_raised_by_a_fifth(
    charts: float, inverse: float, tails: tuple[float, ...], expected: tuple[int, ...]
) -> None:
    """Those of the normal form by as many degrees as the error asks for; phases to odd numbers."""
    errors = Errors(*(x * ALLOWED for x in (0, 0, charts, inverse, *tails)))
    assert Orders(21, 31, 10, 41, 51, 5, 2.5).larger(errors, ALLOWED) == (*expected, 2.5)


def test_the_largest_error_is_that_of_exponents_of_charts_or_of_their_inverse() -> None:
    assert [Errors(*row).largest for row in np.eye(7)] == [1, 0, 1, 1, 0, 0, 0]


@pytest.mark.parametrize("name", Orders._fields)
def test_a_map_of_larger_orders_costs_more(name: str) -> None:
    """And not more than the largest power of them in the number of operations."""
    rough = Rough(coefficients(FIG4.angles(), "1", precision(53)), 1.3342)
    orders = Orders(21, 31, 20, 81, 91, 5, 2.5)
    twice = orders._replace(**{name: 2 * getattr(orders, name)})
    once, more = (building_seconds(rough, x, 53, theta3=True) for x in (orders, twice))
    assert 1 < more / once < 8
    # Where charts cost little a normal form costs as the cube of its degree.
    forms = (Orders(n, 99, 2, 3, 3, 9, 2.5) for n in (50, 100))
    few, many = (building_seconds(rough, x, 53, theta3=False) for x in forms)
    assert 7.5 < many / few < 8.2


def test_a_map_is_expected_to_cost_more_in_more_bits_and_with_theta3() -> None:
    h = exact("1.3342")
    short, whole = (expected_cost(FIG4, h, h, 64, design) for design in (FIRST, WITH_THETA3))
    assert 0.4 < short / whole < 0.85
    costs = [expected_cost(FIG4, h, h, bits, FIRST) for bits in (53, 64, 106, 113)]
    assert costs == sorted(costs)
    assert costs[-1] < 4 * costs[0]


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
