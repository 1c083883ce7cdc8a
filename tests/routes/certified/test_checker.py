"""The checker: every slip that it must notice."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flint import arb

from rigidpend import route_codes
from rigidpend.numbers.exact import exact
from rigidpend.routes.certified import codes
from rigidpend.routes.certified.approximation import Approximation, _fundamental, _Linear, jacobian
from rigidpend.routes.certified.balls import enclosed
from rigidpend.routes.certified.checker import OrbitChecker, ProvenCrossing, Undecided
from rigidpend.routes.certified.codes import MARGIN, check, prove
from rigidpend.routes.certified.models import Model
from rigidpend.routes.certified.pieces import Step
from scripts import check_certificate
from tests.bodies import FIG4, problem
from tests.routes.certified.offered import Start

PHASE = exact("3/10")
PROBLEM = problem(n_symbols=2)
BITS = 70
"""At the start: enough for three crossings of this orbit."""


@pytest.fixture(scope="module")
def steps() -> list[Step]:
    """A proof of two symbols."""
    found = prove(PROBLEM, PHASE, BITS)
    assert found.reason == ""
    return found.steps


def test_one_iteration_squares_the_error_of_runge_and_kutta() -> None:
    """That of Y = 1 + integral J Y, which the fundamental matrix of an orbit solves."""
    start = enclosed(PROBLEM, PHASE, BITS)
    of = Approximation(start.coefficients, start.state)
    half, states = of._in_doubles([x / 2**bits for x, bits in of.state])
    linear = _Linear(states, of.doubles, half)
    middle = jacobian(states @ linear.rule.middles.T, of.doubles)
    first = _fundamental(linear.J, middle, half * np.diff(linear.rule.nodes))
    before, after = (
        np.abs(np.tensordot(linear.rule.integral, half * (linear.J @ Y), 1) + np.eye(6) - Y).max()
        for Y in (first, linear.Y)
    )
    assert after < before**2 < 1e-4


def test_the_checker_finds_again_what_was_proven(steps: list[Step]) -> None:
    again = check(PROBLEM, PHASE, steps)
    assert again.reason == ""
    assert [c.separatrix for c in again.crossings] == [2, 1, 2]
    assert all(c.radius < 1e-3 and c.bound < 2**-6 for c in again.crossings)
    # Those of doubles, of which the third errs by some 1e-7.
    found = route_codes(FIG4, "3/10", h0="1.3342", J1_0="1e-8", n_symbols=2, precisions=(53,))
    assert [c.time for c in again.crossings] == pytest.approx(found.crossing_time[:, 0], abs=1e-6)


@pytest.mark.slow
def test_both_checkers_find_the_same_bounds_and_the_same_crossings(steps: list[Step]) -> None:
    check_certificate.Interval.digits = 2 * steps[0].bits + 256
    walk = check_certificate.Walk(check_certificate.problem_of(Start().given, Fraction(3, 10)))
    checker = OrbitChecker(enclosed(PROBLEM, PHASE, steps[0].bits + 64))
    for step in steps:
        checker.take(step)
        walk.take(check_certificate.Step(*step))
        # Bounds of their own, by other means; rounding alone would be far less.
        assert 0.9 < float(walk.bound.above) / float(checker.bound) < 1.1
    assert walk.separatrices == [c.separatrix for c in checker.crossings] == [2, 1, 2]


def changed(steps: Sequence[Step], k: int, component: int, j: int, by: int) -> list[Step]:
    """The steps with one coefficient changed."""
    series = [list(row) for row in steps[k].series]
    series[component][j] += by
    return [*steps[:k], steps[k]._replace(series=series), *steps[k + 1 :]]


@pytest.mark.parametrize("component", range(6))
@pytest.mark.parametrize("j", [0, 7])
def test_a_changed_coefficient_raises_the_bound(steps: list[Step], component: int, j: int) -> None:
    def bound(given: Sequence[Step]) -> float:
        checker = OrbitChecker(enclosed(PROBLEM, PHASE, given[0].bits + 64))
        for step in given[:4]:
            checker.take(step)
        return float(checker.bound)

    away = steps[3].bits - 30
    assert bound(changed(steps, 3, component, j, 1 << away)) > 100 * bound(steps)


def test_steps_that_do_not_reach_the_last_crossing_do_not_prove_it(steps: list[Step]) -> None:
    found = check(PROBLEM, PHASE, steps[:-1])
    assert found.reason == "the steps end before the last crossing"
    assert len(found.crossings) == 2


def test_a_wait_beyond_its_limit_ends_the_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(codes, "passage_limit", lambda *_: 5.0)
    assert prove(PROBLEM, PHASE, BITS).reason == "no crossing within t' = 5"


def test_a_step_that_ends_on_the_section_is_undecided() -> None:
    checker = OrbitChecker(enclosed(PROBLEM, PHASE, BITS + MARGIN))
    rest = 1 << 60
    flat = [[0], [0], [0], [2 * rest], [0], [0]]
    checker.start = tuple(arb(x) for x in (0, 0, 0, 1, 0, 0))
    with pytest.raises(Undecided, match="M3"):
        checker.take(Step(1, 60, flat))


@pytest.mark.parametrize("rising", [True, False])
@pytest.mark.parametrize(("times", "told"), [(0.999, False), (1.001, True)])
def test_H5_the_large_component_is_farther_from_zero_than_the_orbit(
    rising: bool, times: float, told: bool
) -> None:
    """M3 = +-x in a step, Q is least at its beginning, beside a bound of 1/8."""
    radius, one = arb(1) / 8, 1 << BITS
    here: Any = SimpleNamespace(
        _rate_apart=lambda *_: arb(0),
        _zero=lambda *_: arb(0),
        growth=SimpleNamespace(upright=arb(1)),
        time=arb(0),
        unit=arb(1),
    )
    Q = Model.of_series([round(3 * times * one / 8), round(times * one / 16)], BITS)
    none, M3 = Model.of_series([0], BITS), Model.of_series([0, one if rising else -one], BITS)
    models = [Q if rising else none, none if rising else Q, M3]
    found = OrbitChecker._crossing(here, models, range(4), radius, arb(1), 4)
    assert isinstance(found, ProvenCrossing) == told
    assert told or "Q is too near zero" in str(found)
