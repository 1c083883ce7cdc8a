"""The truth is the same in arithmetics that share nothing."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.experiments.stress.trials import truth
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate import Crossings
from rigidpend.routes.problem import RouteProblem
from tests.orbits.integrate.problems import FIG4


@pytest.mark.slow
def test_integers_agree_with_fours_of_doubles_in_113_bits() -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-6"), 3)
    ours, integers = (
        truth.route_crossings(problem, ["0.4"], truth.Way(engine), bits)
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
    assert truth.phase_errors(found, true, 2.0)[:, 0].tolist() == [0.5, np.inf, 0.0, np.inf]
