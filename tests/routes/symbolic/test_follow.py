"""Addresses of given orbits, and the round phases of a code."""

from __future__ import annotations

import itertools
import re
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend import Body, address_of, find_orbit, route_codes
from rigidpend.mechanics import in_space
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map import MapError
from rigidpend.orbits.return_map.passage import SectionPoint
from rigidpend.routes.cycle import TURNS, symbols
from rigidpend.routes.herpolhode import initial_state, physical, separatrices
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.symbolic.follow import RoundPhases, addressed, round_phases
from rigidpend.routes.symbolic.levels import onward
from tests.bodies import FIG4
from tests.routes.symbolic.fig4 import level

DOCS = Path(__file__).parents[3] / "docs" / "addresses.md"
START: dict[str, Any] = {"h0": "1.3342", "J1_0": "1e-8"}
FIG5 = Body(A=(2, "3/2", "9/5"), r=(0, 1, 0), mu="0.01")
ROUTE: dict[str, Any] = {"h0": "10/9", "J1_0": "2.39205e-9"}
J1_0, PASSAGES, WAIT = "1e-6", 5, 36.0
"""`WAIT` is the longest mean time t' of a passage, and of the way to the first crossing."""
GIVEN = [
    (FIG4, "1.3342", [4.95, 5.97]),
    (Body((2, "1.5", "1.8"), (0, 1, 0), "0.01"), 1, [1.96, 4.55]),
    (Body((3, 2, "2.5"), (1, 2, 0), "0.003"), 1, [2.66, 3.45, 5.97]),
]
"""Bodies, h0 and phases: for each body all passages occur."""


@pytest.mark.parametrize(("body", "h0", "phases"), GIVEN)
def test_an_address_is_what_a_reader_counts(body: Body, h0: Any, phases: list[float]) -> None:
    """Along an orbit in M and gamma, passage by passage, by the function that the page prints."""
    [block] = re.findall(r"```python\n(def cells.*?)```", DOCS.read_text(), re.DOTALL)
    names, met = dict[str, Any](np=np), set()
    exec(block, names)
    problem = RouteProblem(body, exact(h0), exact(J1_0), PASSAGES)
    for phase in phases:
        times = np.linspace(0, WAIT * (PASSAGES + 1), 10_000)
        states = states_at(in_space.field(body), initial_state(problem, phase), times)
        crossings = np.flatnonzero(np.diff(np.sign(states[2])))[: PASSAGES + 1]
        M, gamma = physical(states, body)
        counted = [
            names["cells"](M[:, i : j + 1], gamma[:, i : j + 1])
            for i, j in itertools.pairwise(crossings)
        ]
        beside = separatrices(states)[: PASSAGES + 1]
        wanted = address_of(body, phase, h0=h0, J1_0=J1_0, n_symbols=PASSAGES)
        assert wanted.first == counted[0][0] % 2
        assert wanted.symbols == tuple(symbols(beside))
        assert wanted.half_turns == tuple(int(behind - j) for j, behind in counted)
        met |= set(itertools.pairwise(beside.tolist()))
    assert len(met) == len(TURNS)


@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_a_passage_that_the_map_takes_for_another_is_told_by_its_number(wrong: int) -> None:
    begin = SectionPoint(True, np.array([1e-4]), np.array([0.3]))
    passed = list(onward(level().map_level, begin, 3))
    _, *at = zip(begin, *(each.point for each in passed), strict=True)
    points = SectionPoint(True, *map(np.concatenate, at))
    codes = np.concatenate([each.symbol for each in passed])
    assert addressed(level(), points, codes).symbols == tuple(codes)
    codes[wrong] ^= 1
    with pytest.raises(MapError, match=f"passage {wrong + 1} of the orbit lies outside"):
        addressed(level(), points, codes)


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
    assert route_codes(FIG5, [orbit.theta2_0], **ROUTE, n_symbols=5).words == [code]
    assert str(find_orbit(FIG5, code, **ROUTE, near=published, digits=12).address) == address
    found = round_phases(FIG5, code, **ROUTE, decimals=2)
    assert (found.tried, found.uncertain) == (629, 0)
    assert len(found.theta2_0) == count
    assert found.theta2_0[0] == Decimal(published)
    assert str(found.addresses[0]) == address


def round_(code: Any) -> RoundPhases:
    return round_phases(FIG4, code, **START, decimals=1)


def test_all_phases_of_a_code_are_found_and_of_an_address_those_that_have_it() -> None:
    every, phases = round_("011"), [Decimal(k) / 10 for k in range(63)]
    routes = route_codes(FIG4, phases, **START, n_symbols=3, method="integration")
    of = zip(phases, routes.words, strict=True)
    assert list(every.theta2_0) == [phase for phase, own in of if own == "011"]
    first = every.addresses[0]
    assert first == address_of(FIG4, every.theta2_0[0], **START, n_symbols=3)
    kept = round_(first)
    assert set(kept.addresses) == {first}
    assert kept.theta2_0[0] == every.theta2_0[0]
    assert len(kept.theta2_0) == every.addresses.count(first) < len(every.theta2_0)
    cells = [round_(f"{cell} 011").theta2_0 for cell in "ab"]
    assert sorted(cells[0] + cells[1]) == list(every.theta2_0)
    assert all(cells)


@pytest.mark.slow
def test_where_doubles_do_not_follow_the_address_is_integrated() -> None:
    code = route_codes(FIG4, ["3.3"], **START, n_symbols=24).codes[:, 0]
    found = round_(code)
    assert found.theta2_0 == (Decimal("3.3"),)
    assert found.addresses == (address_of(FIG4, "3.3", **START, n_symbols=24),)


def test_what_is_not_certain_is_counted_and_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    first, *others = round_("011").theta2_0

    def doubted(*given: Any, **named: Any) -> Any:
        found = route_codes(*given, **named)
        found.certain[1, int(10 * first)] = False
        return found

    monkeypatch.setattr("rigidpend.routes.symbolic.follow.route_codes", doubted)
    found = round_("011")
    assert (found.theta2_0, found.uncertain) == (tuple(others), 1)


def test_orbits_outside_of_the_map_have_no_address() -> None:
    body = Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.3")
    found = round_phases(body, "0", **START, decimals=0)
    assert found.theta2_0
    assert set(found.addresses) == {None}
    assert round_phases(body, "a 0", **START, decimals=0).theta2_0 == ()
