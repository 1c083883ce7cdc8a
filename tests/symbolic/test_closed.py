"""Closed orbits by their codes, each closed again by integration in 113 bits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigidpend.floquet import periodic_orbit
from rigidpend.return_map import SectionPoint, return_map
from rigidpend.symbolic import AddressError, NoOrbit, closed_orbit
from rigidpend.symbolic.chain import on_surface, signs_of, tangents
from rigidpend.symbolic.closed import ClosedOrbit, closed, lyapunov, words
from rigidpend.symbolic.closing import closing
from rigidpend.symbolic.shortest import path
from rigidpend.symbolic.tables import Level
from tests.integrate.problems import FIG4

H = "1.3342"


@pytest.fixture(scope="module")
def level() -> Level:
    return Level(return_map(FIG4, h=H), float(H))


@pytest.fixture(scope="module")
def orbits(level: Level) -> list[ClosedOrbit]:
    """All of up to six symbols, with 11 half rotations a passage."""
    return [closed(level, word, 11) for word in words(6)]


def test_words_are_those_of_a_full_shift() -> None:
    """Moebius' formula counts primitive necklaces."""
    found = [len(word) for word in words(8)]
    assert [found.count(n) for n in range(1, 9)] == [2, 1, 2, 3, 6, 9, 18, 30]


def test_all_words_have_an_orbit(orbits: list[ClosedOrbit]) -> None:
    assert max(orbit.chain.residual for orbit in orbits) < 1e-12
    places = {(round(o.chain.d[0], 12), round(o.chain.chi[0] % (2 * math.pi), 9)) for o in orbits}
    assert len(places) == len(orbits) == 23
    assert not any(orbit.stable for orbit in orbits)


@pytest.mark.slow
@pytest.mark.parametrize("word", [(1,), (0, 1), (0, 0, 1, 0, 1, 1)])
def test_integration_closes_to_rounding(level: Level, word: tuple[int, ...]) -> None:
    orbit = closed(level, word, 11)
    found = closing(FIG4, orbit, level, h=H)
    assert found.error < found.expected < 1e-17
    assert found.moved < 1e-11
    assert float(found.period) == pytest.approx(orbit.period, abs=1e-10)


def test_multipliers_are_those_of_small_deviations(level: Level) -> None:
    """The trace against differences of the map itself, followed round."""
    orbit = closed(level, (0, 1), 11)
    steps, columns = (1e-9, 1e-6), []
    for k in range(2):
        ends = []
        for side in (1, -1):
            point = orbit.chain.d[0], orbit.chain.chi[0]
            moved = [np.array([x + side * steps[k] * (k == j)]) for j, x in enumerate(point)]
            at = level.map_level.passage(SectionPoint(True, *moved))
            turned, at = at.turned, level.map_level.passage(at.point)
            ends.append([at.point.d[0], moved[1][0] + turned[0] + at.turned[0] - 22 * math.pi])
        columns.append((np.array(ends[0]) - ends[1])[k] / (2 * steps[k]))
    assert sum(columns) == pytest.approx(orbit.trace, rel=1e-4)


def test_long_passages_have_the_multiplier_of_what_they_pass(level: Level) -> None:
    """Two half rotations more multiply each passage's stretching by the Floquet multiplier."""
    few, many = (closed(level, (0,), n).trace for n in (18, 20))
    floquet = periodic_orbit(FIG4.angles(), float(H), 2, 1).multiplier
    growth = max(abs(floquet), 1 / abs(floquet))
    assert many / few == pytest.approx(growth**2, rel=1e-3)


def test_averages_over_cycles_are_those_of_a_long_orbit(
    level: Level, orbits: list[ClosedOrbit]
) -> None:
    symbols = np.random.default_rng(0).integers(0, 2, 4000)
    chain = path(level, on_surface, signs_of(symbols), 11 * np.arange(4001), 0.0).chain
    change, total = np.array([0.0, 1.0]), 0.0
    for slope in tangents(level, chain):
        change = slope[:2] @ change
        size = float(np.linalg.norm(change))
        change, total = change / size, total + math.log(size)
    assert lyapunov(orbits, 6) == pytest.approx(total / 4000, abs=0.02)
    with pytest.raises(ValueError, match="points"):
        lyapunov(orbits[1:], 6)


def test_a_word_read_backward_is_the_orbit_reversed(level: Level) -> None:
    """The reversor turns the order, and with the orbits' places the symbols, of even words."""
    word = (0, 0, 0, 1, 0, 1)
    mirror = tuple(1 - s for s in word[::-1])
    one, other = closed(level, word, 11), closed(level, mirror, 11)
    assert one.period == pytest.approx(other.period, rel=1e-12)
    assert one.trace == pytest.approx(other.trace, rel=1e-6)


def test_wrong_words_are_refused() -> None:
    with pytest.raises(AddressError, match="0 and 1"):
        closed_orbit(FIG4, "012", h=H)
    with pytest.raises(AddressError, match="without half rotations"):
        closed_orbit(FIG4, "0^9", h=H)
    with pytest.raises(NoOrbit):
        closed_orbit(FIG4, "0011", h=H, half_turns=4)
    assert closed_orbit(FIG4, "0011", h=H).half_turns < 12
