"""Predicted errors against errors that are made; what agrees passes, what does not is noticed."""

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.stress import passages, roundings, scenes
from rigidpend.experiments.stress.scenes import SIGMAS, Scene, followed
from rigidpend.experiments.stress.schema import Passages
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.integrate.states import states_at
from tests.bodies import FIG4, problem
from tests.experiments.stress.verdicts import failed
from tests.orbits.integrate.problems import on_separatrix

SCENE = Scene(FIG4, 1.4, 1, 11)
SIZES = Passages.model_validate(
    {"orbits": "4", "n_crossings": "8", "columns": {"53": "16"}, "checked": {"53": "1"}}
)


def test_the_mean_of_normal_errors_is_that_of_samples() -> None:
    sample = np.abs(np.random.default_rng(2).normal(size=400_000))
    assert np.exp(np.log(sample).mean()) == pytest.approx(passages.GEOMETRIC, rel=0.01)


def test_growths_agree_with_two_orbits_side_by_side() -> None:
    near, far = (on_separatrix(2, FIG4, 1e-4, 2.1 + x, 1.4) for x in (0.0, 1e-9))
    found = followed(SCENE, Orbits(SCENE.c, np.stack((near, far), axis=1), 7, 500.0)).time
    apart = np.abs(np.diff(found, axis=1))[:, 0]
    times, grown = roundings.growths(SCENE, near, 150.0)
    assert np.allclose(times[:7], found[:, 0], atol=0.01)
    # At the first crossing both are still too close for times in doubles.
    assert np.allclose(grown[1:7] - grown[1], np.log(apart / apart[1])[1:], atol=0.01)
    assert grown[6] - grown[1] > 3


@pytest.mark.parametrize("end", [12.0, -12.0])
def test_deviations_are_those_of_roundings_made_one_by_one(end: float) -> None:
    """Each component after each step, moved by itself, moves the end; the squares add."""
    times, orbits, errors = roundings.deviations(SCENE, SCENE.starts(1, 1e-3), end)
    assert np.abs(np.diff(times)) == pytest.approx(roundings.step(SCENE.u), rel=0.05)
    moved = []
    for time, x in zip(times[1:], orbits[1:], strict=True):
        aside = x + 1e-6 * x * np.hstack((np.eye(6), -np.eye(6)))
        y = states_at(SCENE.c, aside, [end - time])[:, 0]
        moved.append((y[:, :6] - y[:, 6:]) / 2e-6)
    expected = roundings.NOISE * np.linalg.norm(np.hstack(moved), axis=1)
    assert errors[-1, :, 0] == pytest.approx(expected, rel=1e-5, abs=0)


def test_predicted_errors_are_those_of_many_digits_also_where_they_have_grown_most() -> None:
    """By another program in 113 bits, which carries them back from each crossing, step by step."""
    scene = Scene(FIG4, 1.4146731071169765, 1, 1)
    known = (
        (63.66389588608289, 2.45646e-13),
        (133.09982222419092, 1.59342e-10),
        (203.38630400247985, 2.30890e-07),
        (239.51407303637157, 2.99400e-05),
        (256.3596226342304, 6.84090e-05),
    )
    times, errors = np.array(known).T
    predicted = roundings.predicted_errors(scene, scene.starts(2, 1e-8)[:, 1:], times[:, None])
    assert predicted[:, 0] == pytest.approx(errors, rel=1e-3, abs=0)


@pytest.mark.slow
def test_errors_are_as_predicted_and_others_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = passages.growth_trial(SCENE, 1e-6, SIZES)
    made: Any = trial.tried()
    assert failed(made) == set()
    curve = made["curves"]["growth"]
    assert 1.5 < curve["growth_predicted"] < 5
    # Four standard errors of the mean of four logarithms.
    drawn = np.log(curve["measured"] / curve["predicted"])[passages.SETTLED :]
    assert np.abs(drawn).max() < 4 * passages.LOG_NORMAL / 2
    monkeypatch.setattr(scenes, "DEFAULT_TOLERANCE", {"taylor": 1e-9})
    assert "size of errors" in failed(trial)


@pytest.mark.slow
def test_decided_symbols_are_as_predicted_and_right_and_a_wrong_one_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Also where the higher precision is not sure of itself."""
    trial = passages.decided_trial(SCENE, problem(FIG4, 60, SCENE.h0, 1e-6), "53", SIZES)
    computed: list[Any] = []

    def kept(*given: Any, right: Any = scenes.routes, **more: Any) -> Any:
        computed.append(right(*given, **more))
        return computed[-1]

    monkeypatch.setattr(scenes, "routes", kept)
    made: Any = trial.tried()
    assert failed(made) == set()
    curve = made["curves"]["53_bits"]
    assert len(curve["measured"]) == 16
    assert 10 < np.median(curve["measured"]) < 50
    _, finer = computed
    assert finer.bits[0] > 53
    finer.codes[3, 0] ^= 1
    finer.certain[:] = False
    again, beyond = iter(computed), curve["predicted"] + 2 * trial.claims[0].bound
    monkeypatch.setattr(scenes, "routes", lambda *_, **__: next(again))
    monkeypatch.setattr(passages, "predicted_symbols", lambda *_: beyond)
    assert failed(trial) == {"decided by 53 bits", "decided by 53 bits, wrong"}


def test_symbols_are_decided_up_to_the_first_large_error() -> None:
    """More bits decide more, and half as many bits again judge them.

    A thousandth of a radian is as `routes.certainty` has it, but said here: that one is judged.
    """
    errors = np.array([1e-8, 1e-5, 1.1e-3, 1e-6, 10.0])
    assert [passages.decided(errors * x) for x in (1, 0.9, 1e-6, 1e6)] == [1, 3, 4, 0]
    asked = problem(FIG4, 40, SCENE.h0, 1e-6)
    few, more = (passages.predicted_symbols(SCENE, asked, bits, 2) for bits in (40, 53))
    # Thirteen bits are 9 nats, and a passage takes about one.
    assert 4 < (more - few).mean() < 20
    assert [passages.finer(bits) for bits in (53, 64, 106, 113)] == [113, 113, 212, 226]


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
    expected = passages.median_spread(bits, 64, 10**9, nu) / SIGMAS
    assert expected == pytest.approx(spread, rel=0.2)
