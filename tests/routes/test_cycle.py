"""The graph of Fig. 2 and its symbols, from where the separatrices lie."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigidpend.numbers.expressions import NO_SYMBOL
from rigidpend.routes.cycle import TURNS, symbols
from tests.routes.reference import fig4_left, vertex_theta1

UPWARDS, DOWNWARDS = (2, 4), (1, 3)

FIG5 = [
    # The paper's routes, the vertices of the separatrices alone; the notes' codes of them.
    ("2-2*-1*-1-4-4*-3*-3-4-4*-1*-1", [0, 0, 0, 1, 1]),
    ("2-2*-3*-3-4-4*-1*-1-2-2*-1*-1", [1, 1, 1, 1, 0]),
]


def way(arriving: int, leaving: int) -> float:
    """From one separatrix to the other, the shorter way around 4 pi."""
    place = vertex_theta1([arriving, leaving])
    return float((place[1] - place[0] + 2 * math.pi) % (4 * math.pi) - 2 * math.pi)


@pytest.mark.parametrize("turn", TURNS)
def test_symbol_is_the_side_on_which_the_next_separatrix_lies(turn: tuple[int, int, int]) -> None:
    arriving, leaving, symbol = turn
    # cos(theta1 - beta0) - cos(alpha0) has one sign between neighbours, so the flow along
    # J1 = 0 or J1 = J2 goes straight from one to the other, less than 2 pi away.
    assert abs(way(arriving, leaving)) < 2 * math.pi - 0.1
    assert symbol == (way(arriving, leaving) > 0)


@pytest.mark.parametrize(("route", "code"), FIG5)
def test_published_routes_of_fig5_have_these_codes(route: str, code: list[int]) -> None:
    vertices = route.split("-")
    separatrices = [int(vertex[0]) for vertex in vertices]
    # A vertex and its star are the two ends of one separatrix.
    assert separatrices[::2] == separatrices[1::2]
    assert [int(z) for z in symbols(separatrices[::2])] == code


def test_symbols_follow_theta1_along_the_reference_orbits() -> None:
    theta1 = fig4_left().theta1
    places = vertex_theta1([1, 2, 3, 4])
    distance = np.abs((theta1 - places[:, None, None] + 2 * math.pi) % (4 * math.pi) - 2 * math.pi)
    assert distance.min(axis=0).max() < 0.01
    # theta1 is followed through all turns: that it rose is symbol 1.
    found = symbols(1 + distance.argmin(axis=0))
    np.testing.assert_array_equal(found, np.diff(theta1, axis=0) > 0)


@pytest.mark.parametrize("walk", [[2, 0], [0, 0], [0, 2], [2, 2], [2, 4], [1, 3], [1, 1]])
def test_no_symbol_where_there_is_no_turn(walk: list[int]) -> None:
    assert symbols(walk).tolist() == [NO_SYMBOL] == [255]


def test_symbols_keep_the_shape_of_the_columns() -> None:
    found = symbols(np.array([[2, 2], [1, 3], [4, 0], [3, 0]]))
    assert found.tolist() == [[0, 1], [0, NO_SYMBOL], [0, NO_SYMBOL]]
    assert found.dtype == np.uint8
