"""Addresses of given orbits, and the round phases of a code."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
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
from tests.routes.symbolic.test_find import FIG5, ROUTE, START, codes_of

DOCS = Path(__file__).parents[3] / "docs" / "addresses.md"
J1_0, PASSAGES, WAIT = "1e-6", 5, 36.0
"""`WAIT` is the longest mean time t' of a passage, and of the way to the first crossing."""
GIVEN = [
    (FIG4, "1.3342", [4.95, 5.97]),
    (Body((2, "1.5", "1.8"), (0, 1, 0), "0.01"), 1, [1.96, 4.55]),
    (Body((3, 2, "2.5"), (1, 2, 0), "0.003"), 1, [2.66, 3.45, 5.97]),
]
"""Bodies, h0 and phases: for each body all passages occur."""


def documented() -> Callable[[Any, Any], Any]:
    """The function that the page prints."""
    [block] = re.findall(r"```python\n(def cells.*?)```", DOCS.read_text(), re.DOTALL)
    names: dict[str, Any] = {"np": np}
    exec(block, names)
    found: Callable[[Any, Any], Any] = names["cells"]
    return found


@pytest.mark.parametrize(("body", "h0", "phases"), GIVEN)
def test_an_address_is_what_a_reader_counts(body: Body, h0: Any, phases: list[float]) -> None:
    """Along an orbit in M and gamma, passage by passage."""
    cells, met = documented(), set()
    problem = RouteProblem(body, exact(h0), exact(J1_0), PASSAGES)
    for phase in phases:
        times = np.linspace(0, WAIT * (PASSAGES + 1), 10_000)
        states = states_at(in_space.field(body), initial_state(problem, phase), times)
        crossings = np.flatnonzero(np.diff(np.sign(states[2])))[: PASSAGES + 1]
        M, gamma = physical(states, body)
        counted = [
            cells(M[:, i : j + 1], gamma[:, i : j + 1]) for i, j in itertools.pairwise(crossings)
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
    assert codes_of(FIG5, orbit.theta2_0, 5, ROUTE) == code
    assert str(find_orbit(FIG5, code, **ROUTE, near=published, digits=12).address) == address
    found = round_phases(FIG5, code, **ROUTE, decimals=2)
    assert (found.tried, found.uncertain) == (629, 0)
    assert len(found.theta2_0) == count
    assert found.theta2_0[0] == Decimal(published)
    assert str(found.addresses[0]) == address


@pytest.fixture(scope="module")
def every() -> RoundPhases:
    return round_phases(FIG4, "011", **START, decimals=1)


def test_all_phases_of_a_code_are_found(every: RoundPhases) -> None:
    phases = [Decimal(k) / 10 for k in range(63)]
    routes = route_codes(FIG4, phases, **START, n_symbols=3, method="integration")
    of = zip(phases, routes.words, strict=True)
    assert list(every.theta2_0) == [phase for phase, own in of if own == "011"]
    assert every.addresses[0] == address_of(FIG4, every.theta2_0[0], **START, n_symbols=3)


def test_an_address_leaves_those_that_have_it(every: RoundPhases) -> None:
    first = every.addresses[0]
    assert first is not None
    kept = round_phases(FIG4, first, **START, decimals=1)
    assert set(kept.addresses) == {first}
    assert kept.theta2_0[0] == every.theta2_0[0]
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


def test_what_is_not_certain_is_counted_and_left_out(
    every: RoundPhases, monkeypatch: pytest.MonkeyPatch
) -> None:
    def doubted(*given: Any, **named: Any) -> Any:
        found = route_codes(*given, **named)
        found.certain[1, int(10 * every.theta2_0[0])] = False
        return found

    monkeypatch.setattr("rigidpend.routes.symbolic.follow.route_codes", doubted)
    found = round_phases(FIG4, "011", **START, decimals=1)
    assert (found.theta2_0, found.uncertain) == (every.theta2_0[1:], 1)


def test_orbits_outside_of_the_map_have_no_address() -> None:
    body = Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.3")
    found = round_phases(body, "0", **START, decimals=0)
    assert found.theta2_0
    assert set(found.addresses) == {None}
    assert round_phases(body, "a 0", **START, decimals=0).theta2_0 == ()
