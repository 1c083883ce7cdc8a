"""A lie would be found; orbits are found and read back, and what goes wrong is found out."""

from __future__ import annotations

from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.experiments import principal_axes
from rigidpend.experiments.stress import honesty, scenes
from rigidpend.numbers.exact import exact
from rigidpend.routes import certainty
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.symbolic import NoOrbit, find_orbit
from tests.experiments.stress.verdicts import asked, changed, failed, verdicts
from tests.orbits.integrate.problems import FIG4, needs_heyoka
from tests.remembered import remembered

CLAIMS = {
    *("lies at 0.01", "lies at 0.0001", "lies by default"),
    *("against 113 bits", "uncertain", "right at the coarsest"),
}
OWN = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 4)
ADDRESSES = honesty.address_trial("x", OWN, 1, 3)


CODES = principal_axes.codes
HARD_SYMBOLS = "10000110010110000101010111010110"


def run(tolerances: str = "[0.01, 0.0001]") -> Any:
    """Forty orbits, two of which are checked in 113 bits, tried."""
    problem = asked(f"honesty.tolerances={tolerances}", "seed=5")
    return honesty.trial(problem, "1e-8", 40, 2, 1).tried()


def failures(trial: Any) -> set[str]:
    """Names of claims that failed, without the start that all of them are of."""
    return {name.rpartition(", ")[0] or name for name in failed(trial)}


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_lies_errors_doubt_and_trials_that_show_nothing_are_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is computed rightly, which all cases share, is computed once."""
    routes, codes = (remembered(x) for x in (scenes.routes, _in_principal_axes))
    monkeypatch.setattr(scenes, "routes", routes)
    monkeypatch.setattr(principal_axes, "codes", lambda *x, bits, jobs: codes(*x, bits).copy())
    right = run()
    assert {name.rpartition(", ")[0] for name in right["claims"]} == CLAIMS
    assert failures(right) == set()
    assert failures(run("[1e-13]")) == {"right at the coarsest"}

    def turned(made: RouteCodes, spoilt: bool) -> RouteCodes:
        """The default run is no judge of itself, where it is certain and where it is not."""
        symbols, certain = made.codes.copy(), made.certain.copy()
        symbols[[7, 14], [-1, 0]] ^= not spoilt
        certain[14, 0] = False
        return made._replace(codes=symbols, certain=certain)

    sure, unsure = (np.full((15, 40), x) for x in (True, False))
    values = []
    for change, fails in (
        (lambda made, _: made._replace(certain=unsure), {"uncertain"}),
        (turned, {"lies by default", "against 113 bits", "uncertain"}),
        (lambda made, _: made._replace(certain=sure), {"lies at 0.01", "lies at 0.0001"}),
    ):
        changed(monkeypatch, change, routes)
        made = run()
        assert failures(made) == fails
        names = "lies at 0.01", "right at the coarsest"
        values.append([made["claims"][f"{x}, J1_0 = 1e-8"]["value"] for x in names])
    # Where all is called certain whatever is wrong is a lie, of 40 orbits with 15 symbols each.
    (none, right), *_, (lies, _) = values
    assert none == 0 < lies == pytest.approx(600 * (1 - right))


def _in_principal_axes(problem: RouteProblem, phases: Any, bits: int) -> Any:
    return CODES(problem, phases, bits=bits, jobs=1)


@pytest.mark.slow
def test_without_heyoka_the_orbits_checked_are_followed_in_integers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(principal_axes, "installed", lambda: False)
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-6"), 1)
    doubted = np.full((1, 3), 9, dtype=np.uint8)
    true = honesty.true_codes(problem, np.array([0.4, 1.1, 2.0]), doubted, 1, 1)
    expected = route_codes(FIG4, [0.4], h0="1.3342", J1_0="1e-6", n_symbols=1)
    assert true.tolist() == expected.codes.tolist()


@pytest.mark.slow
def test_the_hard_orbit_tells_where_a_computation_is_compared_with_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # As principal axes have it in 113 bits.
    truth = np.array([list(map(int, HARD_SYMBOLS))], dtype=np.uint8).T
    monkeypatch.setattr(honesty, "true_codes", lambda *_: truth)
    assert failures(honesty.hard_trial()) == set()
    monkeypatch.setattr(certainty, "SECOND", certainty.FIRST)
    assert failures(honesty.hard_trial()) == {"lies on a hard orbit"}


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_no_flag_lies_where_maps_are_spoilt_but_one_that_asks_for_no_agreement(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 15)
    trial = honesty.maps_trial(problem, 1, 60, 2)
    # The first map alone, and all by most.
    few, names = (1, 5), ("lies, one off by 1e-12", "lies, all off by 1e-9")
    monkeypatch.setattr(honesty, "SPOILT_MAPS", [honesty.SPOILT_MAPS[k] for k in few])
    trial = trial._replace(claims=[honesty.MAPS_CLAIMS[k] for k in (*few, -1)])
    made: Any = trial.tried()
    assert set(made["claims"]) >= set(names)
    assert failed(made) == set()
    for limit in ("CLOSE", "AGREEMENT", "LINEAR"):
        monkeypatch.setattr(certainty, limit, 1e9)
    assert "lies, all off by 1e-9" in failed(trial)


def test_no_orbit_is_lost_where_the_starts_share_them(monkeypatch: pytest.MonkeyPatch) -> None:
    shares: list[Any] = []
    monkeypatch.setattr(honesty, "trial", lambda *given: shares.append(given[2:4]))
    monkeypatch.setattr(honesty, "maps_trial", lambda *given: given)
    trials: Any = list(honesty.trials(asked("honesty.orbits=8", "honesty.checked=4"), 1))
    assert shares == [(3, 2), (3, 1), (2, 1)]
    _, _, _, _, of_maps, *rest = trials
    assert of_maps == (RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 15), 1, 2, 1)
    assert [x.name for x in rest] == ["addresses own body", "addresses body 1"]


@pytest.mark.slow
def test_orbits_are_found_and_read_back_and_what_is_found_otherwise_is_found_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found: list[Any] = []

    def kept(*given: Any, **named: Any) -> Any:
        found.append((given[1], find_orbit(*given, **named)))
        return found[-1][1]

    monkeypatch.setattr(honesty, "find_orbit", kept)
    monkeypatch.setattr(honesty, "DIGITS", 14)
    assert failed(ADDRESSES) == set()
    (shortest, orbit), (longer, _) = found
    assert shortest.half_turns is None
    assert longer.symbols == shortest.symbols[:2]
    assert min(longer.half_turns) > 10

    turns, symbols = orbit.address.half_turns, orbit.address.symbols
    for other, own, expected in (
        ({}, {}, set()),
        ({"delay": 2e-9}, {}, {"x: delay"}),
        ({"confirmed": 3}, {}, {"x: read back"}),
        ({}, {"half_turns": (*turns[:3], turns[3] + 1)}, {"x: read back"}),
        ({}, {"symbols": (*symbols[:3], 1 - symbols[3])}, {"x: read back"}),
    ):
        made, read = orbit._replace(**other), orbit.address._replace(**own)
        monkeypatch.setattr(honesty, "find_orbit", lambda *_, made=made, **__: made)
        monkeypatch.setattr(honesty, "address_of", lambda *_, read=read, **__: read)
        assert failed(ADDRESSES) == expected


def test_codes_without_an_orbit_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(honesty, "find_orbit", Mock(side_effect=NoOrbit))
    assert list(verdicts(ADDRESSES).values()) == ["FAILED", "passed", "passed"]


def test_random_bodies_are_bodies_and_differ() -> None:
    drawn = [honesty.drawn(seed, 4) for seed in range(40)]
    assert len({problem.body.A for problem in drawn}) == 40
    for problem in drawn:
        (A1, A2, A3), _, mu = problem.body.floats()
        assert A1 - A3 > 0.14
        assert A3 - A2 > 0.2
        assert 0 < mu < float(problem.h0) / 100
    energies = [float(problem.h0) for problem in drawn]
    assert 0.8 <= min(energies) < 0.9
    assert 1.5 < max(energies) <= 1.6
