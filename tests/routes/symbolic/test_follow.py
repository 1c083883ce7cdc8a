"""Addresses of given orbits."""

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
from rigidpend.routes.symbolic.follow import addressed
from rigidpend.routes.symbolic.levels import onward
from tests.bodies import FIG4
from tests.routes.symbolic.fig4 import level
from tests.routes.symbolic.test_find import FIG5, ROUTE, codes_of

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
    phases = [Decimal(k) / 100 for k in range(629)]
    routes = route_codes(FIG5, phases, **ROUTE, n_symbols=5)
    assert routes.certain.all()
    having = [phase for phase, own in zip(phases, routes.words, strict=True) if own == code]
    assert (having[0], len(having)) == (Decimal(published), count)
    assert str(address_of(FIG5, published, **ROUTE, n_symbols=5)) == address
