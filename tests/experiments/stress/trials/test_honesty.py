"""A lie would be found."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments import heyoka_peer
from rigidpend.experiments.stress.trials import honesty, spoilt_maps
from rigidpend.experiments.stress.trials.claims import tried
from rigidpend.experiments.stress.trials.scenes import Way
from rigidpend.numbers.exact import exact
from rigidpend.orbits import integrate
from rigidpend.routes import certainty
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.problem import RouteProblem
from tests.experiments.stress.trials.verdicts import failed, verdicts
from tests.orbits.integrate.problems import FIG4, needs_heyoka


def run(orbits: int) -> Any:
    return tried(
        honesty.trial(
            FIG4,
            "1.3342",
            "1e-8",
            ("1e-2", "1e-4"),
            Way(integrate.default_engine()),
            orbits=orbits,
            checked=2,
            n_symbols=15,
            seed=5,
        )
    )


def short(names: Any) -> set[str]:
    """Names of claims without the start that all of them are of."""
    return {name.rpartition(", ")[0] or name for name in names}


def failures(trial: Any) -> set[str]:
    return short(failed(trial))


def changed(monkeypatch: pytest.MonkeyPatch, change: Any) -> None:
    def other(*given: Any, **named: Any) -> RouteCodes:
        return change(route_codes(*given, **named), "tolerance" in named)

    monkeypatch.setattr(honesty, "route_codes", other)


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_wrong_symbols_come_and_none_is_called_certain() -> None:
    made = run(300)
    assert (made["curves"]["wrong"].values > 0).all()
    assert made["curves"]["symbols"].values.tolist() == [300 * 15] * 2
    assert short(verdicts(made)) == {
        "lies at 1e-2",
        "lies at 1e-4",
        "lies by default",
        "against 113 bits",
        "uncertain",
        "right at the coarsest",
    }
    assert failures(made) == set()


@pytest.mark.slow
def test_a_computation_that_is_always_sure_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(monkeypatch, lambda made, _: made._replace(certain=np.ones_like(made.certain)))
    made = run(300)
    assert failures(made) == {"lies at 1e-2", "lies at 1e-4"}
    assert np.array_equal(made["curves"]["lies"].values, made["curves"]["wrong"].values)


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_the_default_run_is_no_judge_of_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """One symbol of the default run is turned over, in the last of 40 columns."""

    def turned(made: RouteCodes, spoilt: bool) -> RouteCodes:
        made.codes[7, -1] ^= not spoilt
        return made

    changed(monkeypatch, turned)
    assert failures(run(40)) == {"lies by default"}


@pytest.mark.slow
def test_an_error_in_the_columns_checked_in_113_bits_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def turned(made: RouteCodes, spoilt: bool) -> RouteCodes:
        made.codes[14, 0] ^= not spoilt
        made.certain[14, 0] = False
        return made

    changed(monkeypatch, turned)
    assert failures(run(10)) == {"against 113 bits", "uncertain"}


@pytest.mark.slow
def test_a_computation_that_is_never_sure_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(monkeypatch, lambda made, _: made._replace(certain=np.zeros_like(made.certain)))
    assert failures(run(10)) == {"uncertain"}


@pytest.mark.slow
def test_without_wrong_symbols_the_trial_says_that_it_shows_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fine(*given: Any, **named: Any) -> RouteCodes:
        named.pop("tolerance", None)
        return route_codes(*given, **{**named, "precisions": (53, 64, 113)})

    monkeypatch.setattr(honesty, "route_codes", fine)
    assert failures(run(10)) == {"right at the coarsest"}


def test_without_heyoka_the_orbits_checked_are_followed_in_integers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(heyoka_peer, "installed", lambda: False)
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-6"), 2)
    doubted = np.full((2, 3), 9, dtype=np.uint8)
    true, known = honesty.true_codes(problem, np.array([0.4, 1.1, 2.0]), doubted, 1, 1)
    assert known.tolist() == [True, False, False]
    expected = route_codes(FIG4, [0.4], h0="1.3342", J1_0="1e-6", n_symbols=2)
    assert true[:, 0].tolist() == expected.codes[:, 0].tolist()
    assert (true[:, 1:] == 9).all()


@pytest.mark.slow
def test_the_hard_orbit_tells_where_a_computation_is_compared_with_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert failures(honesty.hard_trial("taylor")) == set()
    monkeypatch.setattr(certainty, "SECOND", certainty.FIRST)
    assert failures(honesty.hard_trial("taylor")) == {"lies on a hard orbit"}


def test_counts() -> None:
    def record(codes: list[int], certain: list[int]) -> RouteCodes:
        empty = np.empty(0)
        shaped = np.array([codes], dtype=np.uint8), np.array([certain], dtype=bool)
        bits, nothing = empty.astype(np.uint16), empty.astype(bool)
        return RouteCodes(empty, *shaped, bits, empty, empty.astype(np.uint8), nothing)

    spoilt = record([0, 1, 1, 0, 1], [1, 1, 0, 0, 1])
    known = np.array([True, True, True, True, False])
    true = np.zeros((1, 5), dtype=np.uint8)
    assert honesty.counted(spoilt, true, known) == honesty.Tally(4, 2, 1)


def of_maps() -> Any:
    trial = spoilt_maps.trial(FIG4, "1.3342", "1e-8", 1, orbits=60, n_symbols=15, seed=2)
    made: Any = tried(trial)
    # 60 orbits in doubles, and one of them again with 64 bits and with 106.
    for which in ("one", "all"):
        assert "of 930 symbols" in made["claims"][f"lies, {which} off by 1e-12"]["note"].values
    return made


@pytest.mark.slow
def test_no_flag_lies_where_maps_are_spoilt() -> None:
    assert failed(of_maps()) == set()


@pytest.mark.slow
def test_flags_that_ask_for_no_agreement_are_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    for limit in ("CLOSE", "AGREEMENT", "LINEAR"):
        monkeypatch.setattr(certainty, limit, 1e9)
    assert "lies, all off by 1e-9" in failed(of_maps())
