"""The extremes are what their names say, and a wrong symbol is noticed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments.stress import extremes, scenes
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import RouteProblem, phase_rate
from tests.experiments.stress.verdicts import changed, failed
from tests.orbits.integrate.problems import GENERIC

ORDINARY = extremes.Extreme("x", J1_0="1e-3")
EVERY = [x for members in extremes.GROUPS.values() for x in members]
RATE = phase_rate(
    RouteProblem(Body(ORDINARY.A, ORDINARY.r, ORDINARY.mu), exact("1.3342"), exact(1e-3), 1)
)


def run(extreme: extremes.Extreme = ORDINARY) -> set[str]:
    return {x.removeprefix("x: ") for x in failed(extremes.trial("bodies", extreme, 1, 1, 1))}


def test_every_body_is_one_and_special_ones_are_special() -> None:
    bodies = {x.name: Body(x.A, x.r, x.mu) for x in EVERY}
    assert all(name in bodies[name].special_cases for name in ("Hess", "Grioli", "flat"))
    angles = [body.angles() for body in bodies.values()]
    assert min(p.alpha0 for p in angles) < 0.11
    assert max(p.alpha0 for p in angles) > np.pi - 0.11
    assert {p.beta0 for p in angles} >= {0.0, np.pi}


@pytest.mark.parametrize(
    ("change", "fails"),
    [
        (lambda x: x, set()),
        (lambda x: x._replace(separatrix=x.separatrix % 4 + 1), {"error"}),
        # A hundredth of a radian is the most that passes.
        (lambda x: x._replace(crossing_time=x.crossing_time + 0.008 / RATE), set()),
        (lambda x: x._replace(crossing_time=x.crossing_time + 0.012 / RATE), {"error"}),
        (lambda x: x._replace(certain=np.zeros_like(x.certain)), {"uncertain"}),
    ],
)
def test_what_is_wrong_late_or_uncertain_fails(
    change: Any, fails: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    changed(monkeypatch, lambda made, _: change(made))
    assert run() == fails


def test_a_start_passes_and_a_spoilt_tolerance_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    place = scenes.Place("x", 3, 1e-3, 1.4, 1e-4, 0.2)
    trial = extremes.start_trial(GENERIC, place, 1, 1, 2)
    assert failed(trial) == set()
    monkeypatch.setattr(scenes, "DEFAULT_TOLERANCE", {"taylor": 1e-6})
    assert failed(trial) == {"x"}
