"""Growth of errors and decided symbols: what agrees passes, what does not is noticed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.stress import passages, scenes
from rigidpend.experiments.stress.claims import tried
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import RouteProblem
from tests.experiments.stress.verdicts import failed, scene
from tests.orbits.integrate.problems import FIG4

SCENE = scene(FIG4, 1.4, 11)


def problem(n_symbols: int) -> RouteProblem:
    return RouteProblem(FIG4, exact(SCENE.h0), exact(1e-6), n_symbols)


def test_geometric_mean_of_a_normal_error() -> None:
    sample = np.abs(np.random.default_rng(2).normal(size=400_000))
    assert np.exp(np.log(sample).mean()) == pytest.approx(passages.GEOMETRIC, rel=0.01)


@pytest.mark.slow
def test_errors_are_as_predicted_and_others_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = passages.growth_trial(SCENE, 1e-6, 4, 8)
    made: Any = tried(trial)
    assert failed(made) == set()
    assert 1.5 < made["curves"]["growth_predicted"].values < 5
    monkeypatch.setattr(scenes, "DEFAULT_TOLERANCE", {"taylor": 1e-9})
    assert "size of errors" in failed(trial)


@pytest.mark.slow
def test_decided_symbols_are_as_predicted_and_right_and_a_wrong_one_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Also where the higher precision is not sure of itself."""
    trial, computed = passages.decided_trial(SCENE, problem(60), 53, 16, 1, 4), []

    def kept(*given: Any, right: Any = scenes.routes, **more: Any) -> Any:
        computed.append(right(*given, **more))
        return computed[-1]

    monkeypatch.setattr(scenes, "routes", kept)
    made: Any = tried(trial)
    assert failed(made) == set()
    assert 10 < np.median(made["curves"]["measured"].values) < 50
    _, finer = computed
    assert finer.bits[0] > 53
    finer.codes[3, 0] ^= 1
    finer.certain[:] = False
    again = iter(computed)
    monkeypatch.setattr(scenes, "routes", lambda *_, **__: next(again))
    beyond = made["curves"]["predicted"].values + 2 * trial.claims[0].bound
    monkeypatch.setattr(passages, "predicted_symbols", lambda *_: beyond)
    assert failed(trial) == {"decided by 53 bits", "decided by 53 bits, wrong"}


def test_more_bits_decide_more_symbols_up_to_a_thousandth_of_a_radian() -> None:
    """As `routes.certainty` has it, but said here: that one is what is judged."""
    few, more = (passages.predicted_symbols(SCENE, problem(40), bits, 2) for bits in (40, 53))
    # Thirteen bits are 9 nats, and a passage takes about one.
    assert 4 < (more - few).mean() < 20
    assert passages.UNDECIDED == 1e-3


def test_slopes_of_orbits_spread_as_those_of_normal_errors() -> None:
    """The bound is four times what slopes of as many independent normal errors scatter by."""
    errors = np.abs(np.random.default_rng(3).normal(size=(16, 20_000)))
    deviation = passages.slopes_of(errors).std() / np.sqrt(64)
    assert passages.slope_spread(64, 16) / deviation == pytest.approx(4, rel=0.02)


@pytest.mark.parametrize("bits", [53, 113])
def test_medians_spread_as_those_of_random_walks(bits: int) -> None:
    """Walks with steps ln |1 - (2 nu/pi) cot(phase)|, from 2^-bits to one."""
    nu, random = FIG4.nu, np.random.default_rng(4)
    phases = random.uniform(0, np.pi, (64 * 200, 3 * bits))
    walk = np.log(np.abs(1 - 2 * nu / np.pi / np.tan(phases))).cumsum(axis=1)
    numbers = (walk > bits * np.log(2)).argmax(axis=1)
    spread = np.median(numbers.reshape(200, 64), axis=1).std()
    expected = passages.median_spread(bits, 64, 10**9, nu) / passages.SIGMAS
    assert expected == pytest.approx(spread, rel=0.2)


def test_what_judges_a_precision_is_a_half_finer_at_least() -> None:
    assert [passages.finer(bits) for bits in (53, 64, 106, 113)] == [113, 113, 212, 226]
