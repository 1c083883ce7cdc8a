"""A lie would be found; orbits are found and read back, and what goes wrong is found out."""

from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.experiments import principal_axes
from rigidpend.experiments.stress import honesty, scenes
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes import certainty
from rigidpend.routes.codes import RouteCodes
from rigidpend.routes.symbolic import NoOrbit, find_orbit
from tests.bodies import FIG4, problem
from tests.experiments.stress.verdicts import asked, changed, failed
from tests.orbits.integrate.problems import needs_heyoka
from tests.remembered import remembered

CLAIMS = {
    *("lies at 0.01", "lies at 0.0001", "lies by default"),
    *("against 113 bits", "uncertain", "right at the coarsest"),
}
ADDRESSES = honesty.address_trial("x", problem(FIG4, 4), 1, 3)
HARD_SYMBOLS = "10000110010110000101010111010110"
"""As principal axes have them in 113 bits."""


def run(tolerances: str = "[0.01, 0.0001]") -> Any:
    """Forty orbits, two of which are checked in 113 bits, tried."""
    config = asked(f"honesty.tolerances={tolerances}", "seed=5")
    return honesty.trial(config, "1e-8", 40, 2, 1).tried()


def failures(trial: Any) -> set[str]:
    """Names of claims that failed, without the start that all of them are of."""
    return {name.rpartition(", ")[0] or name for name in failed(trial)}


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_lies_errors_doubt_and_trials_that_show_nothing_are_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is computed rightly, which all cases share, is computed once."""
    routes, codes = (remembered(x) for x in (scenes.routes, principal_axes.codes))
    monkeypatch.setattr(scenes, "routes", routes)
    monkeypatch.setattr(principal_axes, "codes", lambda *x, **more: codes(*x, **more).copy())
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


@pytest.mark.slow
def test_without_heyoka_the_orbits_checked_are_followed_in_integers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(principal_axes, "installed", lambda: False)
    asked, doubted = problem(n_symbols=1, J1_0="1e-6"), np.full((1, 3), 9, dtype=np.uint8)
    true = honesty.true_codes(asked, np.array([0.4, 1.1, 2.0]), doubted, 1, 1)
    assert true.tolist() == scenes.routes(asked, [0.4], resolve()).codes.tolist()


def test_where_doubles_differ_in_principal_axes_more_bits_tell_the_truth(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of three orbits they get one wrong; one is followed in 113 bits in any case."""
    right, asked = np.array([[0, 1, 1]], dtype=np.uint8), list[tuple[int, list[float]]]()

    def codes(_: Any, phases: Any, *, bits: int, jobs: int) -> Any:
        asked.append((bits, phases.tolist()))
        return right[:, phases.astype(int)] ^ ((phases == 1) & (bits == 53))

    for name, told in (
        ("installed", lambda: True),
        ("working_type", lambda _: True),
        ("codes", codes),
    ):
        monkeypatch.setattr(principal_axes, name, told)
    true = honesty.true_codes(problem(n_symbols=1), np.arange(3.0), right, 1, 1)
    assert true.tolist() == right.tolist()
    assert asked == [(53, [0, 1, 2]), (64, [1]), (113, [0])]


@pytest.mark.slow
def test_the_hard_orbit_tells_where_a_computation_is_compared_with_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    truth = np.array([list(map(int, HARD_SYMBOLS))], dtype=np.uint8).T
    monkeypatch.setattr(honesty, "true_codes", lambda *_: truth)
    assert failures(honesty.hard_trial()) == set()
    monkeypatch.setattr(certainty, "SECOND_SCALES", certainty.FIRST_SCALES)
    assert failures(honesty.hard_trial()) == {"lies on a hard orbit"}


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_no_flag_lies_where_maps_are_spoilt_but_one_that_asks_for_no_agreement(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    trial = honesty.maps_trial(problem(), 1, 60, 2)
    # The first map alone, and all by most.
    few, names = (1, 5), ("lies, one off by 1e-12", "lies, all off by 1e-9")
    monkeypatch.setattr(honesty, "SPOILT_MAPS", [honesty.SPOILT_MAPS[k] for k in few])
    trial = trial._replace(claims=[honesty.MAPS_CLAIMS[k] for k in (*few, -1)])
    made: Any = trial.tried()
    assert set(made["claims"]) >= set(names)
    assert failed(made) == set()
    for limit in ("LIMIT_OF_TWO", "LIMIT_OF_THREE", "LIMIT_OF_UNEQUAL"):
        monkeypatch.setattr(certainty, limit, 1e9)
    assert "lies, all off by 1e-9" in failed(trial)


def test_no_orbit_is_lost_where_the_starts_share_them(monkeypatch: pytest.MonkeyPatch) -> None:
    shares: list[Any] = []
    monkeypatch.setattr(honesty, "trial", lambda *given: shares.append(given[2:4]))
    monkeypatch.setattr(honesty, "maps_trial", lambda *given: given)
    trials: Any = list(honesty.trials(asked("honesty.orbits=8", "honesty.checked=4"), 1))
    assert shares == [(3, 2), (3, 1), (2, 1)]
    _, _, _, _, of_maps, *rest = trials
    assert of_maps == (problem(), 1, 2, 1)
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
    # Codes without an orbit are counted.
    monkeypatch.setattr(honesty, "find_orbit", Mock(side_effect=NoOrbit))
    assert failed(ADDRESSES) == {"x: none found"}


def test_random_bodies_are_bodies_and_differ() -> None:
    drawn = [honesty.drawn(seed, 4) for seed in range(40)]
    assert len({x.body.A for x in drawn}) == 40
    for each in drawn:
        (A1, A2, A3), _, mu = each.body.floats()
        assert A1 - A3 > 0.14
        assert A3 - A2 > 0.2
        assert 0 < mu < float(each.h0) / 100
    energies = [float(x.h0) for x in drawn]
    assert 0.8 <= min(energies) < 0.9
    assert 1.5 < max(energies) <= 1.6
