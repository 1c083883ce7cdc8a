"""Growth of errors and decided symbols: what agrees passes, what does not is noticed."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.stress.trials import passages, scenes
from rigidpend.experiments.stress.trials.claims import tried
from rigidpend.experiments.stress.trials.scenes import Scene, Way
from rigidpend.orbits import integrate
from rigidpend.routes.codes import route_codes
from tests.experiments.stress.trials.verdicts import failed
from tests.orbits.integrate.problems import FIG4

ENGINE = integrate.default_engine()
FAN = passages.Fan(Scene(FIG4, 1.4), 1e-6, 11)
WAY = Way("taylor")
H0 = FIG4.kappa * 1.4**2 / 2


def test_geometric_mean_of_a_normal_error() -> None:
    sample = np.abs(np.random.default_rng(2).normal(size=400_000))
    assert np.exp(np.log(sample).mean()) == pytest.approx(passages.GEOMETRIC, rel=0.01)


@pytest.mark.slow
def test_errors_are_as_predicted_and_others_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def run() -> Any:
        trial = passages.growth_trial(FAN, WAY, orbits=6, n_crossings=8)
        return tried(trial)

    made = run()
    assert failed(made) == set()
    assert 1.5 < made["curves"]["growth_predicted"].values < 5
    monkeypatch.setattr(scenes, "DEFAULT_TOLERANCE", {"taylor": 1e-9})
    assert "size of errors" in failed(run())


def decided() -> Any:
    trial = passages.decided_trial(
        FAN,
        WAY,
        53,
        h0=H0,
        columns=24,
        checked=1,
        n_symbols=60,
        tangents=6,
    )
    return tried(trial)


@pytest.fixture(scope="module")
def honest() -> tuple[Any, list[Any]]:
    """The trial, and the codes that it computed in their order."""
    computed = []

    def kept(*given: Any, **named: Any) -> Any:
        computed.append(route_codes(*given, **named))
        return computed[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(passages, "route_codes", kept)
        return decided(), computed


@pytest.mark.slow
def test_decided_symbols_are_as_predicted_and_right(honest: tuple[Any, list[Any]]) -> None:
    made, _ = honest
    assert failed(made) == set()
    assert 10 < np.median(made["curves"]["measured"].values) < 50


@pytest.mark.slow
def test_a_certain_symbol_that_more_bits_contradict_fails(
    monkeypatch: pytest.MonkeyPatch, honest: tuple[Any, list[Any]]
) -> None:
    """Also where the higher precision is not sure of itself."""
    computed = [copy.deepcopy(made) for made in honest[1]]
    finer = [made for made in computed if made.bits[0] > 53]
    assert finer
    for made in finer:
        made.codes[3, 0] ^= 1
        made.certain[:] = False
    again = iter(computed)
    monkeypatch.setattr(passages, "route_codes", lambda *_, **__: next(again))
    assert "decided by 53 bits, wrong" in failed(decided())


def test_more_bits_decide_more_symbols() -> None:
    few, more = (passages.predicted_symbols(FAN, bits, 40, 2, ENGINE) for bits in (40, 53))
    # Thirteen bits are 9 nats, and a passage takes about one.
    assert 4 < (more - few).mean() < 20


def test_slopes_of_orbits_spread_as_those_of_normal_errors() -> None:
    """The bound is four times what slopes of as many independent normal errors scatter by."""
    errors = np.abs(np.random.default_rng(3).normal(size=(16, 20_000)))
    deviation = passages.slopes_of(errors).std() / np.sqrt(64)
    assert passages.slope_spread(64, 16) / deviation == pytest.approx(4, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("bits", [53, 113])
def test_medians_spread_as_those_of_random_walks(bits: int) -> None:
    """Walks with steps ln |1 - (2 nu/pi) cot(phase)|, from 2^-bits to one."""
    nu, random = FIG4.nu, np.random.default_rng(4)
    phases = random.uniform(0, np.pi, (64 * 200, 6 * bits))
    walk = np.log(np.abs(1 - 2 * nu / np.pi / np.tan(phases))).cumsum(axis=1)
    numbers = (walk > bits * np.log(2)).argmax(axis=1)
    medians = [np.median(numbers.reshape(200, 64), axis=1).std()]
    expected = passages.median_spread(bits, 64, 10**9, nu) / passages.SIGMAS
    assert expected == pytest.approx(medians[0], rel=0.2)


def test_what_judges_a_precision_is_a_half_finer_at_least() -> None:
    assert {passages.finer(bits) for bits in (53, 64)} == {113}
    assert [passages.finer(bits) for bits in (106, 113)] == [212, 226]


def test_a_thousandth_of_a_radian_is_where_symbols_are_no_longer_decided() -> None:
    """As `routes.certainty` has it, but said here: that one is what is judged."""
    assert passages.UNDECIDED == 1e-3
    few, more = (passages.predicted_symbols(FAN, bits, 40, 2, ENGINE) for bits in (50, 53))
    assert 0 < (more - few).mean() < 6
