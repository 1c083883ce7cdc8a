"""The extremes are what their names say, and a wrong symbol is noticed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments.stress.layout import FAILED, PASSED
from rigidpend.experiments.stress.trials import extremes, scenes
from rigidpend.numbers.exact import PRECISIONS, exact
from rigidpend.orbits import integrate
from rigidpend.routes.codes import route_codes
from rigidpend.routes.problem import RouteProblem, phase_rate
from tests.experiments.stress.trials.verdicts import failed, verdicts
from tests.orbits.integrate.problems import GENERIC

WAY = scenes.Way(integrate.default_engine())
ORDINARY = extremes.Extreme("x", J1_0="1e-3")
EVERY = (*extremes.BODIES, *extremes.ENERGIES, *extremes.LOWER, *extremes.UPPER)


def run(extreme: extremes.Extreme) -> list[str]:
    """The verdicts on the error and on what is uncertain."""
    return list(verdicts(extremes.trial(extreme, WAY, columns=1, n_symbols=1)).values())


def test_names_are_unique() -> None:
    names = [x.name for x in EVERY] + [x.name for x in extremes.PLACES]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", ["Hess", "Grioli", "flat"])
def test_special_bodies_are_special(name: str) -> None:
    [member] = [x for x in extremes.BODIES if x.name == name]
    assert name in Body(member.A, member.r, member.mu).special_cases


def test_every_body_is_one() -> None:
    angles = [Body(x.A, x.r, x.mu).angles() for x in EVERY]
    assert min(p.alpha0 for p in angles) < 0.11
    assert max(p.alpha0 for p in angles) > np.pi - 0.11
    assert {p.beta0 for p in angles} >= {0.0, np.pi}


def test_an_ordinary_route_passes() -> None:
    assert run(ORDINARY) == [PASSED, PASSED]


def replaced(monkeypatch: pytest.MonkeyPatch, change: Any) -> None:
    def other(*given: Any, **named: Any) -> Any:
        return change(route_codes(*given, **named))

    monkeypatch.setattr(extremes, "route_codes", other)


def test_a_wrong_certain_symbol_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    replaced(monkeypatch, lambda x: x._replace(separatrix=x.separatrix % 4 + 1))
    assert run(ORDINARY) == [FAILED, PASSED]


@pytest.mark.parametrize(("shift", "verdict"), [(0.8, PASSED), (1.2, FAILED)])
def test_a_phase_error_of_a_hundredth_of_a_radian_is_the_most_that_passes(
    monkeypatch: pytest.MonkeyPatch, shift: float, verdict: str
) -> None:
    problem = RouteProblem(
        Body(ORDINARY.A, ORDINARY.r, ORDINARY.mu), exact("1.3342"), exact(1e-3), 1
    )
    late = 0.01 * shift / phase_rate(problem)
    replaced(monkeypatch, lambda x: x._replace(crossing_time=x.crossing_time + late))
    assert run(ORDINARY) == [verdict, PASSED]


def test_an_uncertain_symbol_fails_where_no_limit_is_declared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    replaced(monkeypatch, lambda x: x._replace(certain=np.zeros_like(x.certain)))
    assert run(ORDINARY) == [PASSED, FAILED]


def test_a_refusal_fails() -> None:
    assert run(extremes.Extreme("x", J1_0="5")) == [FAILED, FAILED]


def test_no_extreme_has_a_declared_limit() -> None:
    trials = [extremes.trial(x, WAY, columns=1, n_symbols=1) for x in EVERY]
    assert not any(claim.limit for trial in trials for claim in trial.claims)


def test_the_truth_has_more_bits_than_what_it_judges() -> None:
    assert max(PRECISIONS) < scenes.INTEGER_BITS
    assert [x.name for x in EVERY if x.long] == ["near-spherical, J1_0 = 1e-80"]


def test_a_start_passes_and_a_spoilt_tolerance_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    place = scenes.Place("x", 3, 1e-3, 1.4, 1e-4, 0.2)

    trial = extremes.start_trial(GENERIC, place, WAY, columns=1, n_crossings=2)
    assert failed(trial) == set()
    monkeypatch.setattr(scenes, "DEFAULT_TOLERANCE", {WAY.engine: 1e-6})
    assert failed(trial) == {"x"}
