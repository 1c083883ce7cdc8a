"""Closed orbits by their codes, each closed again by integration in 113 bits."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.floquet import periodic_orbit
from rigidpend.numbers.generic import Array
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.symbolic import AddressError, NoOrbit, closed_orbit
from rigidpend.routes.symbolic.closed import ClosedOrbit, closed, closing, lyapunov, words
from rigidpend.routes.symbolic.stretching import stretching
from tests.routes.symbolic.fig4 import BODY, H, chain_of, level

TURNS = 11
NEAR = 0.9
"""Radians from its cell's middle within which every crossing of these orbits lies.

Further out, near pi/2, images of the curve below turn back and cross a cell in part."""
SAMPLES = 300
"""Samples of each piece of the curve: a piece is the 20th part of one, or larger."""


@pytest.fixture(scope="module")
def orbits() -> list[ClosedOrbit]:
    """All of up to six symbols, with 11 half rotations a passage."""
    return [closed(level(), word, TURNS) for word in words(6)]


def pieces(n: int, first: int) -> Array:
    """Symbols (n, pieces) on the pieces of a curve that n passages take across a cell each.

    The curve consists of upward crossings: the unstable surface of the lower orbit, to some per
    cent. Where its image by n/2 second returns crosses the cell, one point returns to itself. Only
    the forward map is used, which integration holds: no code, no inverse chart, no chain.
    """
    low, high = np.array([math.pi * first - NEAR]), np.array([math.pi * first + NEAR])
    for k in range(1, n + 1):
        chi = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, SAMPLES)
        start = chi.ravel()
        at = SectionPoint(True, -6.31e-4 * np.cos(start) + 1.54e-4 * np.sin(start), start)
        inside, symbols, grown = np.ones(start.size, dtype=bool), [], start
        for _ in range(k):
            passed = level().map_level.passage(at)
            at, inside, grown = passed.point, inside & passed.inside, grown + passed.turned
            symbols.append(passed.symbol)
        near = inside & (np.abs(grown - math.pi * (first + TURNS * k)) < NEAR)
        kind = np.pad(np.where(near, 1 + symbols[-1], 0).reshape(chi.shape), ((0, 0), (1, 1)))
        changed = kind[:, 1:] != kind[:, :-1]
        begin, end = (np.nonzero(changed & (side > 0)) for side in (kind[:, 1:], kind[:, :-1]))
        low = chi[begin[0], np.maximum(begin[1] - 1, 0)]
        high = chi[end[0], np.minimum(end[1], SAMPLES - 1)]
    return np.array(symbols).reshape(n, *chi.shape)[:, begin[0], begin[1]]


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("n", [2, 4, pytest.param(6, marks=pytest.mark.slow)])
def test_there_are_as_many_orbits_as_the_second_return_has_points(
    orbits: list[ClosedOrbit], n: int, first: int
) -> None:
    found = pieces(n, first)
    assert found.shape[1] == len(np.unique(found, axis=1).T) == 2**n
    periods = [len(orbit.chain.b) for orbit in orbits]
    assert sum(period // 2 for period in periods if n % period == 0) == 2**n


def test_words_are_one_for_each_orbit() -> None:
    """Moebius' formula counts 2, 1, 2, 3, 6, 9, ... necklaces; an even one is two orbits."""
    found = [len(word) for word in words(8)]
    assert [found.count(n) for n in range(1, 9)] == [2, 2, 2, 6, 6, 18, 18, 60]


def test_all_words_have_an_orbit(orbits: list[ClosedOrbit]) -> None:
    assert max(orbit.chain.residual for orbit in orbits) < 1e-12
    places = {(round(o.chain.d[0], 12), round(o.chain.chi[0] % (2 * math.pi), 9)) for o in orbits}
    assert len(places) == len(orbits) == 36
    assert not any(orbit.stable for orbit in orbits)


@pytest.mark.slow
@pytest.mark.parametrize("word", [(1,), (0, 0, 1, 0, 1, 1)])
def test_integration_closes_to_rounding(word: tuple[int, ...]) -> None:
    orbit = closed(level(), word, TURNS)
    found = closing(orbit)
    assert found.error < found.expected < 1e-17
    assert found.moved < 1e-11
    assert float(found.period) == pytest.approx(orbit.period, abs=1e-10)


@pytest.mark.slow
def test_an_orbit_closes_where_a_passage_stretches_more_than_a_thousand_times() -> None:
    body = Body((2, "1.01", "1.48"), ("0.85", "0.53", 0), "0.0004")
    found = closing(closed_orbit(body, "0", h=1, half_turns=17))
    assert found.error < found.expected < 1e-15


@pytest.mark.slow
def test_a_gap_is_less_than_expected_where_passages_happen_to_meet_sharply() -> None:
    body = Body((2, "1.32", "1.72"), ("0.62", "0.02", 0), "3.68e-3")
    found = closing(closed_orbit(body, "01", h=1))
    assert found.error < found.expected < 1e-26


def test_long_passages_have_the_multiplier_of_what_they_pass() -> None:
    """Two half rotations more multiply each passage's stretching by the Floquet multiplier."""
    few, many = (closed(level(), (0,), n).trace for n in (18, 20))
    floquet = periodic_orbit(BODY.angles(), float(H), 2, 1).multiplier
    growth = max(abs(floquet), 1 / abs(floquet))
    assert many / few == pytest.approx(growth**2, rel=1e-3)


@pytest.mark.slow
def test_averages_over_cycles_are_those_of_a_long_orbit(orbits: list[ClosedOrbit]) -> None:
    grown = stretching(chain_of(np.random.default_rng(0).integers(0, 2, 4000)))
    parts = [float(np.mean(part)) for part in np.array_split(grown[1:], 20)]
    error = np.std(parts, ddof=1) / math.sqrt(20)
    for n in range(2, 7):
        assert abs(lyapunov(orbits, n) - np.mean(grown[1:])) < 3 * error < 0.015
    with pytest.raises(ValueError, match="points of period 6 instead of 64"):
        lyapunov(orbits[1:], 6)


def reversed_word(word: tuple[int, ...]) -> tuple[int, ...]:
    """Read backward with 0 and 1 exchanged: the least of the words along the reversed orbit."""
    mirror = tuple(1 - s for s in word[::-1])
    return min(mirror[k:] + mirror[:k] for k in range(0, len(word), 1 if len(word) % 2 else 2))


def test_orbits_with_one_multiplier_are_each_other_reversed(orbits: list[ClosedOrbit]) -> None:
    """All others of their length differ by half a per cent at least, 01 from 10 too."""
    image = {o.word: reversed_word(o.word) for o in orbits}
    assert sum(word == other for word, other in image.items()) == 10
    for one, other in itertools.product(orbits, repeat=2):
        if len(one.word) == len(other.word):
            alike = abs(one.trace / other.trace - 1) < 1e-9
            assert alike == (one is other or image[one.word] == other.word)
            assert alike or abs(one.trace / other.trace - 1) > 4e-3
            assert not alike or one.period == pytest.approx(other.period, abs=1e-11)


def test_other_orbits_begin_in_the_other_cell() -> None:
    """With 0 and 1 exchanged they are alike to first order in mu, and no further."""
    one, other = (closed_orbit(BODY, word, h=H, half_turns=TURNS) for word in ("01", "b 10"))
    assert one.chain.chi[0] == pytest.approx(0, abs=1e-12)
    assert other.chain.chi[0] == pytest.approx(math.pi, abs=1e-12)
    assert 1e-5 < abs(one.trace / other.trace - 1) < 1e-3


def test_wrong_words_are_refused() -> None:
    with pytest.raises(AddressError, match="0 and 1"):
        closed_orbit(BODY, "012", h=H)
    with pytest.raises(AddressError, match="without half rotations"):
        closed_orbit(BODY, "0^9", h=H)
    with pytest.raises(NoOrbit):
        closed_orbit(BODY, "0011", h=H, half_turns=4)
    assert closed_orbit(BODY, "0011", h=H).half_turns < 12


@pytest.mark.parametrize("trace", [-3.0, -2.02, -1.98, 0.0, 1.98, 2.02, 3.0])
def test_a_multiplier_is_of_its_trace_and_not_inside_of_the_unit_circle(trace: float) -> None:
    """Its inverse is the other one, for the map preserves the area."""
    nothing: Any = None
    orbit = ClosedOrbit((0,), TURNS, False, 1.0, trace, nothing)
    m = orbit.multiplier
    assert m + 1 / m == pytest.approx(trace)
    assert abs(m) >= 1 - 1e-15
    assert orbit.stable == (abs(trace) < 2)
