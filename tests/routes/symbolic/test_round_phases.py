"""Phases of few decimals that have a code: the paper's own, and a count by other means."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

import pytest

from rigidpend import Body, address_of, find_orbit, route_codes
from rigidpend.routes.symbolic.follow import round_phases
from tests.orbits.integrate.problems import FIG4
from tests.routes.symbolic.test_find import FIG5, ROUTE, START, codes_of


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "published", "address", "count"),
    [
        ("00011", "1.02", "a 0^29 (0^31)*2 1^32 1^28", 4),
        ("11110", "1.83", "a 1^38 1^29 1^31 1^29 0^30", 11),
    ],
)
def test_both_published_phases_come_out_of_their_codes_and_their_addresses(
    code: str, published: str, address: str, count: int
) -> None:
    """The paper prints two decimals; of its codes alone these are the least such phases."""
    orbit = find_orbit(FIG5, address, **ROUTE, digits=12)
    assert f"{orbit.theta2_0:.2f}" == published
    assert codes_of(FIG5, orbit.theta2_0, 5, ROUTE) == code
    assert str(find_orbit(FIG5, code, **ROUTE, near=published, digits=12).address) == address
    found = round_phases(FIG5, code, **ROUTE, decimals=2)
    assert (found.tried, found.uncertain) == (629, 0)
    assert len(found.theta2_0) == count
    assert found.theta2_0[0] == Decimal(published)
    assert str(found.addresses[0]) == address


def test_all_phases_of_a_code_are_found() -> None:
    phases = [Decimal(k) / 10 for k in range(63)]
    codes = route_codes(FIG4, phases, **START, n_symbols=3, method="integration").codes
    for code in ("011", "100"):
        wanted = [
            p for p, own in zip(phases, codes.T, strict=True) if "".join(map(str, own)) == code
        ]
        found = round_phases(FIG4, code, **START, decimals=1)
        assert list(found.theta2_0) == wanted
        assert found.addresses[0] == address_of(FIG4, wanted[0], **START, n_symbols=3)


def test_an_address_leaves_those_that_have_it() -> None:
    every = round_phases(FIG4, "011", **START, decimals=1)
    first, one = every.addresses[0], every.theta2_0[0]
    assert first is not None
    kept = round_phases(FIG4, first, **START, decimals=1)
    assert one in kept.theta2_0
    assert set(kept.addresses) == {first}
    assert len(kept.theta2_0) == every.addresses.count(first) < len(every.theta2_0)
    cells = [round_phases(FIG4, f"{cell} 011", **START, decimals=1).theta2_0 for cell in "ab"]
    assert sorted(cells[0] + cells[1]) == list(every.theta2_0)
    assert all(cells)


@pytest.mark.slow
def test_where_doubles_do_not_follow_the_address_is_integrated() -> None:
    code = route_codes(FIG4, ["3.3"], **START, n_symbols=24).codes[:, 0]
    found = round_phases(FIG4, code, **START, decimals=1)
    assert found.theta2_0 == (Decimal("3.3"),)
    assert found.addresses == (address_of(FIG4, "3.3", **START, n_symbols=24),)


def test_what_is_not_certain_is_counted_and_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    every = round_phases(FIG4, "011", **START, decimals=1)

    def doubted(*given: Any, **named: Any) -> Any:
        found = route_codes(*given, **named)
        found.certain[1, int(10 * every.theta2_0[0])] = False
        return found

    monkeypatch.setattr("rigidpend.routes.symbolic.follow.route_codes", doubted)
    found = round_phases(FIG4, "011", **START, decimals=1)
    assert (found.theta2_0, found.uncertain) == (every.theta2_0[1:], 1)


def test_orbits_outside_of_the_map_have_no_address() -> None:
    body: Any = Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.3")
    found = round_phases(body, "0", **START, decimals=0)
    assert found.theta2_0
    assert set(found.addresses) == {None}
    assert round_phases(body, "a 0", **START, decimals=0).theta2_0 == ()
