"""The trial of addresses: orbits are found and read back, and what goes wrong is found out."""

from __future__ import annotations

from typing import Any

import pytest

from rigidpend.experiments.stress import addresses
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.symbolic import NoOrbit, find_orbit
from tests.experiments.stress.verdicts import failed, verdicts
from tests.orbits.integrate.problems import FIG4

OWN = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 4)
TRIAL = addresses.trial("x", OWN, 1, 3)


@pytest.mark.slow
def test_orbits_are_found_and_read_back_and_what_is_found_otherwise_is_found_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found: list[Any] = []

    def remembered(*given: Any, **named: Any) -> Any:
        found.append((given[1], find_orbit(*given, **named)))
        return found[-1][1]

    monkeypatch.setattr(addresses, "find_orbit", remembered)
    assert failed(TRIAL) == set()
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
        monkeypatch.setattr(addresses, "find_orbit", lambda *_, made=made, **__: made)
        monkeypatch.setattr(addresses, "address_of", lambda *_, read=read, **__: read)
        assert failed(TRIAL) == expected


def test_codes_without_an_orbit_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: Any, **__: Any) -> Any:
        raise NoOrbit

    monkeypatch.setattr(addresses, "find_orbit", none)
    assert list(verdicts(TRIAL).values()) == ["FAILED", "passed", "passed"]


def test_random_bodies_are_bodies_and_differ() -> None:
    drawn = [addresses.drawn(seed, 4) for seed in range(100)]
    assert len({problem.body.A for problem in drawn}) == 100
    for problem in drawn:
        (A1, A2, A3), _, mu = problem.body.floats()
        assert A1 - A3 > 0.14
        assert A3 - A2 > 0.2
        assert 0 < mu < float(problem.h0) / 100
