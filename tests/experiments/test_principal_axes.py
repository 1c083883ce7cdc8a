"""Orbits in principal axes: the same routes from equations that share no component with ours."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments import principal_axes
from rigidpend.numbers.exact import exact
from rigidpend.routes.codes import route_codes
from rigidpend.routes.problem import RouteProblem
from tests.orbits.integrate.problems import FIG4, GENERIC, needs_heyoka
from tests.routes.reference import fig4_left


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
@pytest.mark.parametrize("bits", [53, 113])
def test_agrees_the_left_array_of_fig_4(bits: int) -> None:
    phases = [exact(f"{k}/10") for k in (1, 17, 40)]
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 6)
    expected = fig4_left().codes[:6, [1, 17, 40]]
    assert np.array_equal(principal_axes.codes(problem, phases, bits=bits, jobs=1), expected)


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_agrees_another_body_and_the_jobs_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    phases: Any = np.array([0.3, 1.9, 4.4])
    problem = RouteProblem(GENERIC, exact("1.3"), exact("1e-3"), 4)
    expected = route_codes(GENERIC, phases, h0="1.3", J1_0="1e-3", n_symbols=4).codes
    # Processes would take a second each to begin; what they are given they can be sent.
    monkeypatch.setattr(
        principal_axes,
        "side_by_side",
        lambda work, given, _, parts, jobs: [
            pickle.loads(pickle.dumps(work))(*pickle.loads(pickle.dumps((part, *given))))
            for part in parts
        ],
    )
    for jobs in (1, 2):
        found = principal_axes.codes(problem, phases, bits=53, jobs=jobs)
        assert np.array_equal(found, expected)


@needs_heyoka("orbits in principal axes")
def test_where_an_orbit_does_not_cross_in_time_there_is_no_symbol(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = RouteProblem(FIG4, exact("1.3"), exact("1e-3"), 2)
    monkeypatch.setattr(principal_axes, "passage_limit", lambda *_: 1.0)
    assert principal_axes.codes(problem, [0.3], bits=53, jobs=1).tolist() == [[255], [255]]


def test_a_crossing_lies_beside_the_nearest_separatrix_modulo_4_pi() -> None:
    places = np.array([-1.0, 1.0, 5.0, 7.0])
    theta1 = np.array([[1.2, -1.4, np.nan], [4 * np.pi + 6.8, 5.1 - 4 * np.pi, 4 * np.pi - 1.2]])
    assert principal_axes.beside(theta1, places).tolist() == [[2, 1, 0], [4, 3, 1]]
