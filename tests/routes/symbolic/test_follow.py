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
from scipy.integrate import solve_ivp

from rigidpend import Body, address_of, find_orbit, route_codes
from rigidpend.orbits.return_map import MapError
from rigidpend.orbits.return_map.passage import SectionPoint
from rigidpend.routes.symbolic.follow import _addressed, round_phases
from tests.orbits.integrate.problems import FIG4
from tests.routes.symbolic.fig4 import level
from tests.routes.symbolic.test_find import FIG5, ROUTE, START, codes_of

DOCS = Path(__file__).parents[3] / "docs" / "addresses.md"
J1_0 = 1e-6
PASSAGES = 5
SYMBOLS = {
    (2, 3): 1, (2, 1): 0, (4, 1): 1, (4, 3): 0,
    (3, 4): 1, (3, 2): 0, (1, 2): 1, (1, 4): 0,
}  # fmt: skip
"""Of passages from one separatrix to another, by the figure of the heteroclinic cycle."""


def documented() -> Callable[[Any, Any], Any]:
    """The function that the page prints."""
    [block] = re.findall(r"```python\n(def cells.*?)```", DOCS.read_text(), re.DOTALL)
    names: dict[str, Any] = {"np": np}
    exec(block, names)
    found: Callable[[Any, Any], Any] = names["cells"]
    return found


class Student:
    """Orbits of N bodies side by side: Euler and Poisson's equations, integrated by SciPy."""

    def __init__(self, given: Any) -> None:
        A, r, self.mu = (np.array(x, dtype=float).T for x in list(zip(*given, strict=True))[:3])
        self.A, self.r = A, r / np.linalg.norm(r, axis=0)
        self.s = np.sqrt(1 / A[1] - 1 / A[0])
        self.alpha0 = 2 * np.arcsin(np.sqrt(1 / A[1] - 1 / A[2]) / self.s)
        self.beta0 = 2 * np.arctan2(r[1], r[0])

    def start(self, theta2: Any, h0: Any) -> Any:
        """M and gamma at theta1_0 = alpha0 + beta0 and J1_0 (eqs. depri_G, depri_g and canon)."""
        J2 = np.sqrt(2 * h0 * self.A[2]) * self.s
        sinp = 2 * J1_0 / J2 - 1
        cosp = 2 * np.sqrt(J1_0 * (J2 - J1_0)) / J2
        l, g = self.alpha0 / 2, (self.alpha0 + self.beta0) / 2 + theta2
        M1, M2, M3 = (x * J2 / self.s for x in (cosp * np.sin(l), cosp * np.cos(l), sinp))
        gamma1 = sinp * np.cos(g) * np.sin(l) + np.sin(g) * np.cos(l)
        gamma2 = sinp * np.cos(g) * np.cos(l) - np.sin(g) * np.sin(l)
        return np.array([M1, M2, M3, gamma1, gamma2, -cosp * np.cos(g)])

    def rates(self, t: float, y: Any) -> Any:
        """Derivatives in t' = t s, so that passages of all bodies take about as long."""
        (A1, A2, A3), (r1, r2, _), mu = self.A, self.r, self.mu
        M1, M2, M3, g1, g2, g3 = y.reshape(6, -1)
        w1, w2, w3 = M1 / A1, M2 / A2, M3 / A3
        field = (
            M2 * w3 - M3 * w2 - mu * g3 * r2,
            M3 * w1 - M1 * w3 + mu * g3 * r1,
            M1 * w2 - M2 * w1 + mu * (g1 * r2 - g2 * r1),
            g2 * w3 - g3 * w2,
            g3 * w1 - g1 * w3,
            g1 * w2 - g2 * w1,
        )
        return (np.array(field) / self.s).ravel()

    def separatrix(self, k: int, state: Any) -> int:
        """The separatrix beside which a crossing lies: where one of M's two components is small."""
        half = self.alpha0[k] / 2
        x, y = np.cos(half) * state[0], np.sin(half) * state[1]
        if abs(x + y) > abs(x - y):
            return 2 if x + y > 0 else 4
        return 3 if x - y > 0 else 1


FOURTH, FIFTH, THIRD = (
    ((2, 1, 1.5), (1, 1, 0), 0.001, 1.3342),
    ((2, 1.5, 1.8), (0, 1, 0), 0.01, 1.0),
    ((3, 2, 2.5), (1, 2, 0), 0.003, 1.0),
)
"""A, r, mu and h0."""
ORBITS = [
    *((*FOURTH, 4.95), (*FOURTH, 5.97), (*FIFTH, 1.96), (*FIFTH, 4.55)),
    *((*THIRD, 2.66), (*THIRD, 3.45), (*THIRD, 5.97)),
]
"""With theta2_0: for each body all passages occur."""
WAIT = 36.0
"""Longest mean time t' of a passage, and of the way to the first crossing."""


@pytest.mark.slow
def test_an_address_is_what_a_reader_counts() -> None:
    student, cells = Student(ORBITS), documented()
    h0, theta2 = np.array([orbit[3:] for orbit in ORBITS]).T
    at = np.linspace(0, WAIT * (PASSAGES + 1), 10_000)
    states = solve_ivp(
        student.rates, (0.0, float(at[-1])), student.start(theta2, h0).ravel(), "DOP853", at,
        rtol=1e-10, atol=1e-13,
    ).y.reshape(6, len(ORBITS), -1)  # fmt: skip
    met = set()
    for k, (A, r, mu, h, phase) in enumerate(ORBITS):
        state = states[:, k]
        crossings = np.flatnonzero(np.diff(np.sign(state[2])))[: PASSAGES + 1]
        passages = [state[:, i : j + 1] for i, j in itertools.pairwise(crossings)]
        counted = [cells(each[:3], each[3:]) for each in passages]
        sides = [
            (student.separatrix(k, x[:, 0]), student.separatrix(k, x[:, -1])) for x in passages
        ]
        wanted = address_of(Body(A=A, r=r, mu=str(mu)), phase, h0=h, J1_0=J1_0, n_symbols=PASSAGES)
        assert wanted.first == counted[0][0] % 2
        assert wanted.symbols == tuple(SYMBOLS[side] for side in sides)
        assert wanted.half_turns == tuple(int(behind - j) for j, behind in counted)
        met |= {(A, side) for side in sides}
    assert len(met) == 3 * len(SYMBOLS)


@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_a_passage_that_the_map_takes_for_another_is_told_by_its_number(wrong: int) -> None:
    at, symbols = [SectionPoint(True, np.array([1e-4]), np.array([0.3]))], []
    for _ in range(3):
        passed = level().map_level.passage(at[-1])
        at.append(passed.point)
        symbols.append(passed.symbol)
    points = SectionPoint(
        True, *(np.concatenate([getattr(x, y) for x in at]) for y in ("d", "chi"))
    )
    codes = np.concatenate(symbols).astype(np.uint8)
    assert _addressed(level(), points, codes).symbols == tuple(codes)
    codes[wrong] ^= 1
    with pytest.raises(MapError, match=f"passage {wrong + 1} of the orbit lies outside"):
        _addressed(level(), points, codes)


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
