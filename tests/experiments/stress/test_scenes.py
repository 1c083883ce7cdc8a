"""The truth is the same in arithmetics that share nothing; starts are where they say."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.experiments.stress import scenes
from rigidpend.experiments.stress.extremes import PLACES
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, canonical_from_aligned
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate import Crossings
from rigidpend.routes.problem import RouteProblem
from tests.orbits.integrate.problems import FIG4


@pytest.mark.slow
def test_integers_agree_with_fours_of_doubles_in_113_bits() -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-6"), 1)
    ours, integers = (
        scenes.route_crossings(problem, ["0.4"], 1, bits, engine)
        for engine, bits in (("taylor", 113), ("scipy", 160))
    )
    assert np.array_equal(ours.separatrix, integers.separatrix)
    assert np.abs(ours.time - integers.time).max() <= 1e-13


def test_phase_errors_count_another_separatrix_as_infinite() -> None:
    def record(times: list[float], beside: list[int]) -> Crossings:
        outcome = np.zeros(1, dtype=np.uint8)
        return Crossings(np.array([times]).T, np.array([beside], dtype=np.uint8).T, outcome)

    found = record([1.0, 2.5, np.nan, np.nan], [2, 1, 0, 0])
    true = record([1.25, 2.5, np.nan, 9.0], [2, 3, 0, 4])
    assert scenes.phase_errors(found, true, 2.0)[:, 0].tolist() == [0.5, np.inf, 0.0, np.inf]


@pytest.mark.parametrize("place", PLACES, ids=lambda x: x.name)
def test_places_are_where_they_say(place: scenes.Place) -> None:
    made = Aligned(*scenes.state(place, FIG4, 0.7))
    M, gamma = body_from_aligned(made, FIG4.alpha0, 1.0)
    back = canonical_from_aligned(made, FIG4.alpha0, FIG4.beta0)
    assert M @ gamma == pytest.approx(place.J3, abs=1e-14)
    assert float(back.J1) == pytest.approx(place.J1, rel=1e-12)
    assert float(back.J2mJ1) == pytest.approx(place.J2mJ1, rel=1e-12)
    large, small = (made.Qp, made.Qm) if place.separatrix in (2, 4) else (made.Qm, made.Qp)
    assert (small == 0) == (place.aside == 0)
    assert np.sign(large) == {1: -1, 2: 1, 3: 1, 4: -1}[place.separatrix]
