"""A lie would be found."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments import principal_axes
from rigidpend.experiments.stress import honesty
from rigidpend.experiments.stress.claims import tried
from rigidpend.numbers.exact import exact
from rigidpend.routes import certainty
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.problem import RouteProblem
from tests.experiments.stress.verdicts import asked, changed, failed
from tests.orbits.integrate.problems import FIG4, needs_heyoka

CLAIMS = {
    *("lies at 0.01", "lies at 0.0001", "lies by default"),
    *("against 113 bits", "uncertain", "right at the coarsest"),
}


def run(orbits: int, tolerances: str = "[0.01, 0.0001]") -> Any:
    problem = asked(f"honesty.tolerances={tolerances}", "seed=5")
    return tried(honesty.trial(problem, "1e-8", orbits, 2, 1))


def failures(trial: Any) -> set[str]:
    """Names of claims that failed, without the start that all of them are of."""
    return {name.rpartition(", ")[0] or name for name in failed(trial)}


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_wrong_symbols_come_and_none_is_called_certain_but_where_all_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = run(100)
    assert (made["curves"]["wrong"].values > 0).all()
    assert made["curves"]["symbols"].values.tolist() == [100 * 15] * 2
    assert {name.rpartition(", ")[0] for name in made["claims"]} == CLAIMS
    assert failures(made) == set()
    changed(monkeypatch, lambda made, _: made._replace(certain=np.ones_like(made.certain)))
    sure = run(100)
    assert failures(sure) == {"lies at 0.01", "lies at 0.0001"}
    assert np.array_equal(sure["curves"]["lies"].values, made["curves"]["wrong"].values)


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
@pytest.mark.parametrize(
    ("row", "column", "certain", "fails"),
    [
        # One symbol of the default run is turned over: it is no judge of itself.
        (7, -1, True, {"lies by default"}),
        (14, 0, False, {"against 113 bits", "uncertain"}),
    ],
)
def test_an_error_of_the_default_run_is_found(
    row: int, column: int, certain: bool, fails: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def turned(made: RouteCodes, spoilt: bool) -> RouteCodes:
        made.codes[row, column] ^= not spoilt
        made.certain[row, column] &= certain
        return made

    changed(monkeypatch, turned)
    assert failures(run(10)) == fails


@pytest.mark.slow
def test_a_computation_that_is_never_sure_fails_and_one_that_never_errs_shows_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    changed(monkeypatch, lambda made, _: made._replace(certain=np.zeros_like(made.certain)))
    assert failures(run(4)) == {"uncertain"}
    monkeypatch.undo()
    assert failures(run(10, "[1e-13]")) == {"right at the coarsest"}


def test_without_heyoka_the_orbits_checked_are_followed_in_integers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(principal_axes, "installed", lambda: False)
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
    assert failures(honesty.hard_trial()) == set()
    monkeypatch.setattr(certainty, "SECOND", certainty.FIRST)
    assert failures(honesty.hard_trial()) == {"lies on a hard orbit"}


def test_lies_are_counted_where_the_truth_is_known() -> None:
    codes, certain = (np.array([x]) for x in ([0, 1, 1, 0, 1], [1, 1, 0, 0, 1]))
    spoilt: Any = RouteCodes(codes, codes, certain > 0, *[codes] * 4)
    known, true = np.array([True] * 4 + [False]), np.zeros((1, 5), dtype=np.uint8)
    assert honesty.counted(spoilt, true, known) == (4, 2, 1)


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_no_flag_lies_where_maps_are_spoilt_but_one_that_asks_for_no_agreement(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 15)
    trial = honesty.maps_trial(problem, 1, 60, 2)
    made: Any = tried(trial)
    # 60 orbits in doubles, and one of them again with 64 bits and with 106.
    for which in ("one", "all"):
        assert "of 930 symbols" in made["claims"][f"lies, {which} off by 1e-12"]["note"].values
    assert failed(made) == set()
    monkeypatch.setattr(honesty, "SPOILT_MAPS", [("all", "1e-9")])
    claims = honesty.MAPS_CLAIMS[5:]
    for limit in ("CLOSE", "AGREEMENT", "LINEAR"):
        monkeypatch.setattr(certainty, limit, 1e9)
    assert "lies, all off by 1e-9" in failed(trial._replace(claims=claims))


def test_no_orbit_is_lost_where_the_starts_share_them(monkeypatch: pytest.MonkeyPatch) -> None:
    shares: list[Any] = []
    monkeypatch.setattr(honesty, "trial", lambda *given: shares.append(given[2:4]))
    trials = list(honesty.trials(asked("honesty.orbits=8", "honesty.checked=4"), 1))
    assert shares == [(3, 2), (3, 1), (2, 1)]
    assert (len(trials), trials[-1].name) == (5, "spoilt maps")
