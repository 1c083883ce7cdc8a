"""The experiment `herpolhodes`: its routes, and those that are no result."""

from contextlib import nullcontext
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.experiments.herpolhodes import compute as herpolhodes
from rigidpend.routes.codes import codes_of
from rigidpend.routes.herpolhode import follow
from rigidpend.routes.problem import passage_rotations
from tests.experiments.trees import asked, computed


@pytest.fixture(scope="module")
def content() -> Any:
    return asked("fig5")


def test_each_route_is_told_with_the_error_of_its_samples(content: Any) -> None:
    """That the routes are the published ones is told by the report, and tested there."""
    reported: list[str] = []
    data = computed(content, report=reported.append)
    starts = [f"{name}: {each['route']}, crossing times within " for name, each in data.items()]
    assert all(map(str.startswith, reported, starts))


def test_a_route_that_is_not_certain_or_is_left_is_no_result(
    content: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither one uncertain symbol, nor one that is missing."""

    def spoilt(field: str) -> Any:
        def compute(*given: Any, **named: Any) -> Any:
            made = codes_of(*given, **named)
            assert min(given[2].precisions) > 53, "the samples' error is told by more bits"
            getattr(made, field)[-1] = 0
            return made

        return compute

    for field, said in (("certain", "the route is not certain"), ("separatrix", "the orbit stays")):
        monkeypatch.setattr(herpolhodes, "codes_of", spoilt(field))
        with pytest.raises(ArithmeticError, match=rf"theta2_0 = 1\.02: {said}"):
            computed(content)
    monkeypatch.undo()
    with pytest.raises(ArithmeticError, match=r"theta2_0 = 1\.02: .* leaves the route; take fewer"):
        computed(asked("fig5", "problem.n_symbols=18"))


CASE = "problem.cases={case: {theta2_0: %s}}"


def test_a_route_with_a_short_passage_after_it_is_a_result() -> None:
    """A heavy body: the next passage is much shorter than the last, of which half is sampled."""
    heavy = "problem.mu=0.3", "problem.J1_0=1e-5", "problem.n_symbols=1", "problem.n_wound=1"
    [case] = computed(asked("fig5", *heavy, CASE % "5.032")).values()
    first, last = case["crossing_time"]
    assert case["route"] == "2-2*-1*-1"
    half = np.sign(case["J1_over_J2"] - 0.5)
    assert np.count_nonzero(np.diff(half)) == 2, "no crossing that is not the route's"
    assert 0 < (case["t"][-1] - last) / (last - first) < 0.1


THIN = "problem.A=[1, 1e-6, 0.9999995]", "problem.r=[1, 2, 0]", "problem.h0=1", "problem.J1_0=1e-9"


def test_samples_of_a_thin_body_cross_with_its_route_or_are_told_to_be_too_few() -> None:
    """pi - alpha0 is 1.4e-6, of which an angle in doubles has ten digits."""
    [case] = computed(
        asked("fig5", *THIN, "problem.n_symbols=3", "numerics.points=1000", CASE % "0.7")
    ).values()
    assert np.abs(case["crossing_error"]).max() < 1e-12 * case["crossing_time"][-1]
    with pytest.raises(ArithmeticError, match=r"miss a crossing .* numerics\.points"):
        computed(asked("fig5", *THIN, "problem.n_symbols=3", CASE % "0.7"))


@pytest.mark.parametrize("J1_0", ["1e-9", "0.05", "0.3", "0.6"])
def test_plateaus_are_those_of_theta3_wherever_on_separatrix_2_the_orbit_starts(J1_0: str) -> None:
    """Halfway between crossings, up to a hundredth of an increment."""
    settings = "problem.mu=1e-4", f"problem.J1_0={J1_0}", "problem.n_symbols=3"
    for case in computed(asked("fig5", *settings)).values():
        crossing = case["crossing_time"]
        halfway = np.searchsorted(case["t"], (crossing[1:] + crossing[:-1]) / 2)
        gap = np.abs(case["theta3"][halfway] - case["plateaus"][1:-1]).max()
        assert gap < 0.01 * np.abs(np.diff(case["plateaus"])).max()


@pytest.mark.parametrize("share", [0.000995, 0.001005])
def test_an_orbit_is_on_its_route_to_a_thousandth_of_the_shortest_passage(
    content: Any, monkeypatch: pytest.MonkeyPatch, share: float
) -> None:

    def late(problem: Any, theta2_0: float, times: Any, **how: Any) -> Any:
        made = follow(problem, theta2_0, times, **how)
        made.crossing_error[-1] = -share * np.diff(times).min()
        return made

    monkeypatch.setattr(herpolhodes, "follow", late)
    leaves = pytest.raises(ArithmeticError, match="leaves the route; take fewer symbols")
    with nullcontext() if share < 1e-3 else leaves:
        computed(content)


@pytest.mark.parametrize(("count", "said"), [(1, "a larger J1_0"), (2, "fewer symbols")])
def test_an_orbit_of_one_symbol_is_not_asked_to_have_fewer(
    monkeypatch: pytest.MonkeyPatch, count: int, said: str
) -> None:
    monkeypatch.setattr(herpolhodes, "ON_ROUTE", 0.0)
    with pytest.raises(ArithmeticError, match=f"leaves the route; take {said}"):
        computed(asked("fig5", f"problem.n_symbols={count}", f"problem.n_wound={count}"))


def test_samples_beyond_memory_are_refused_before_the_route_is_sought(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a body with nu = 2e10 a passage has some 1e11 turns."""
    monkeypatch.setattr(herpolhodes, "codes_of", Mock(side_effect=AssertionError))
    nearly = "problem.A=[1, 1 - 2e-10, 1 - 1e-10]"
    with pytest.raises(ArithmeticError, match=r"turns some 1\.\de\+11 times in 6 passages"):
        computed(asked("fig5", nearly))
    shipped = asked("fig5")
    samples = passage_rotations(shipped.problem.routes) * 6 * shipped.numerics.points
    for most in (0.99 * samples, 1.01 * samples):
        monkeypatch.setattr(herpolhodes, "MOST_SAMPLES", most)
        with pytest.raises(ArithmeticError if most < samples else AssertionError):
            computed(asked("fig5"))
