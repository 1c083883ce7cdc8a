"""The trial of addresses: orbits are found and read back, and what goes wrong is found out."""

from __future__ import annotations

from typing import Any

import pytest

from rigidpend.experiments.stress.trials import addresses
from rigidpend.experiments.stress.trials.claims import Trial
from rigidpend.routes.symbolic import (
    Address,
    FoundOrbit,
    NoOrbit,
    find_orbit,
)
from tests.experiments.stress.trials.verdicts import failed, verdicts
from tests.orbits.integrate.problems import FIG4

OWN = addresses.Setup(FIG4, "1.3342")


def trial(**more: int) -> Trial:
    return addresses.trial("x", OWN, **{"words": 1, "n_symbols": 4, "seed": 3, **more})


@pytest.fixture(scope="module")
def orbit() -> FoundOrbit:
    return find_orbit(FIG4, "a 0^11 1^12 1^11 0^13", h0="1.3342", J1_0="1e-8", digits=26)


@pytest.mark.slow
def test_orbits_are_found_and_read_back(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def remembered(body: Any, code: Address, **named: Any) -> Any:
        asked.append(code)
        return find_orbit(body, code, **named)

    monkeypatch.setattr(addresses, "find_orbit", remembered)
    assert failed(trial()) == set()
    shortest, longer = asked
    assert shortest.half_turns is None
    assert longer.symbols == shortest.symbols[:2]
    assert min(longer.half_turns or ()) > 10


@pytest.mark.parametrize(
    ("changed", "own", "expected"),
    [
        ({}, {}, ["passed", "passed", "passed"]),
        ({"delay": 2e-9}, {}, ["passed", "passed", "FAILED"]),
        ({"confirmed": 3}, {}, ["passed", "FAILED", "passed"]),
        ({}, {"half_turns": (11, 11, 11, 12)}, ["passed", "FAILED", "passed"]),
        ({}, {"symbols": (0, 1, 1, 1)}, ["passed", "FAILED", "passed"]),
    ],
)
def test_what_is_found_otherwise_is_found_out(
    orbit: FoundOrbit,
    changed: dict[str, Any],
    own: dict[str, Any],
    expected: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    read = orbit.address._replace(**own)
    monkeypatch.setattr(addresses, "find_orbit", lambda *_, **__: orbit._replace(**changed))
    monkeypatch.setattr(addresses, "address_of", lambda *_, **__: read)
    assert list(verdicts(trial()).values()) == expected


def test_codes_without_an_orbit_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: Any, **__: Any) -> Any:
        raise NoOrbit

    monkeypatch.setattr(addresses, "find_orbit", none)
    assert list(verdicts(trial()).values()) == ["FAILED", "passed", "passed"]


def test_random_bodies_are_bodies_and_differ() -> None:
    drawn = [addresses.drawn(seed) for seed in range(100)]
    assert len({setup.body.A for setup in drawn}) == 100
    for setup in drawn:
        A1, A2, A3 = (float(x) for x in setup.body.A)
        assert A1 - A3 > 0.14
        assert A3 - A2 > 0.2
        assert 0 < float(setup.body.mu) < float(setup.h0) / 100
