"""Which engine serves, what is refused, that `jobs` changes nothing; DOP853 as one system."""

import functools
import math
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.orbits.integrate import Crossings, Outcome, dop853
from rigidpend.orbits.integrate.arithmetic import in_kernel, resolve, rung
from tests.orbits.integrate.problems import FIG4, FREE, WAYS, fan, find, on_separatrix, same, task


def test_the_kernel_serves_up_to_424_bits() -> None:
    asked = (53, 54, 64, 106, 107, 212, 424)
    assert [in_kernel("taylor", bits) for bits in (*asked, 425)] == [True] * 7 + [False]
    assert list(map(rung, asked)) == [53, 106, 106, 106, 212, 212, 424]
    assert list(map(rung, (10.5, 106.5, 424.5, 10_000.2))) == [53, 212, 448, 10_001]
    assert resolve(None, None, (53, 64, 106)).precisions == (53, 64, 106)
    assert not any(in_kernel("scipy", bits) for bits in (53, 64, 113))
    assert resolve("scipy", None, (53, 64, 106)).precisions == (53, 106)
    assert resolve("scipy", None, (64,)).precisions == (64,)


def test_groups_that_share_their_steps_follow_each_other_in_order() -> None:
    """65 orbits are two groups, of 33 and 32."""
    states = fan(65)
    found = find(states, "scipy", n_crossings=1, tolerance=1e-6)
    last = find(states[:, 33:], "scipy", n_crossings=1, tolerance=1e-6)
    assert found.time.shape == (1, 65)
    np.testing.assert_array_equal(found.time[:, 33:], last.time)
    alone = find(states[:, 64:], "scipy", n_crossings=1, tolerance=1e-6)
    assert 0 < abs(alone.time[0, 0] - last.time[0, -1]) < 1e-3


def test_errors_of_Q_count_by_the_smallest_orbit_and_others_by_one() -> None:
    states = np.concatenate((fan(2, J1=1e-4), fan(1, J1=1e-24), fan(1, J1=1e-8)), axis=1)
    states[1] = states[0] / 1024
    smallest = abs(states[0, 2])
    assert smallest < 1e-11
    floor = dop853.floor(task(states), 2.0**-30)
    np.testing.assert_array_equal(floor.T * 2.0**30, [[smallest, smallest, 1, 1, 1, 1]])
    states[:2] = 0
    np.testing.assert_array_equal(dop853.floor(task(states), 0.5), np.full((6, 1), 0.5))


# ---- Every engine on the same orbits, from bit for bit the same numbers, and on closed solutions.

EACH = [("taylor", 53), ("taylor", 106), ("scipy", 53), ("scipy", 60)]
"""One way for each way of computing: doubles, sums of them, a system of SciPy's, integers."""
J2, THETA2, V = 1.3, 0.7, 12.0
"""|M|, initial phase and v of the separatrices below: J1 rises from 6e-6 J2."""


@pytest.mark.slow
def test_agrees_integers_with_sums_of_doubles_from_a_small_J1() -> None:
    """From J1 = 1e-60: the small component has its own leading zeros."""
    expected = find(fan(1, J1=1e-60), "scipy", 60, n_crossings=1).time
    found = find(fan(1, J1=1e-60), "taylor", 106, n_crossings=1)
    # The time on a step is found in doubles, and the sum rounded.
    np.testing.assert_allclose(found.time, expected, rtol=3e-16)


@pytest.mark.parametrize(
    ("separatrix", "engine", "bits"), [(2 + 2 * (k % 2), *way) for k, way in enumerate(EACH)]
)
def test_agrees_the_one_crossing_of_an_unperturbed_separatrix(
    separatrix: int, engine: str, bits: int
) -> None:
    begin = on_separatrix(separatrix, FREE, J2 / (math.exp(V) + 1), THETA2, J2)
    found = find(begin[:, None], engine, bits, body=FREE, passage_limit=40)
    # J1 = J2/2 where u t = v; then the orbit stays on Q = 0 and never comes back.
    assert found.time[0, 0] == pytest.approx(V / (J2 * math.sin(FREE.alpha0)), abs=1e-10)
    assert np.isnan(found.time[1:]).all()
    assert found.separatrix[:, 0].tolist() == [separatrix, 0, 0, 0]
    assert found.outcome.tolist() == [Outcome.ASYMPTOTIC]


@functools.cache
def whole(engine: str, bits: int) -> tuple[Any, Crossings]:
    """An orbit with two crossings."""
    begin = fan(3, J1=1e-2)[:, [2]]
    return begin, find(begin, engine, bits, n_crossings=2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "bits", "short"),
    # DOP853 looks at the end of each step.
    [(*way, 0.75 if way == ("scipy", 53) else 1 - 1e-9) for way in EACH],
)
def test_outcome_a_limit_ends_an_orbit_before_a_crossing_that_comes_later(
    engine: str, bits: int, short: float
) -> None:
    begin, expected = whole(engine, bits)
    waited = float(np.diff(expected.time, axis=0)[0, 0])
    assert waited > 10
    found = find(begin, engine, bits, n_crossings=2, passage_limit=waited * (1 + 1e-9))
    assert same(found, expected)
    for limit, crossed in ((waited * short, 1), (1.0, 0)):
        found = find(begin, engine, bits, n_crossings=2, passage_limit=limit)
        assert found.outcome.tolist() == [Outcome.NO_CROSSING]
        assert np.isfinite(found.time).sum() == np.count_nonzero(found.separatrix) == crossed


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), EACH)
def test_outcome_orbits_that_end_differently_share_a_call(engine: str, bits: int) -> None:
    """gamma = 0 takes the weight away: such an orbit is asymptotic beside others that go on."""
    states = fan(3, J1=1e-2)[:, 1:]
    states[3:, 0] = 0
    found = find(states, engine, bits, n_crossings=2, passage_limit=30)
    assert found.outcome.tolist() == [Outcome.ASYMPTOTIC, Outcome.COMPLETE]
    alone = whole("taylor", 106) if bits > 53 else whole(engine, bits)
    np.testing.assert_allclose(found.time[:, [1]], alone[1].time, rtol=1e-12)
    assert found.separatrix[:, 0].tolist() == [2, 0]


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_agrees_that_a_start_on_the_section_is_no_crossing(
    engine: str, bits: int, sense: int
) -> None:
    """M3 leaves zero in the sense of M1 M2, which grows with Qp^2 - Qm^2, and returns."""
    Q = (1, 0.2) if sense > 0 else (0.2, 1)
    begin = np.array([[*Q, 0, 0.6, 0.8, 0]]).T
    heavy = Body(FIG4.A, FIG4.r, "0.01")
    found = find(begin, engine, bits, body=heavy, n_crossings=2, passage_limit=30)
    assert found.outcome.tolist() == [Outcome.COMPLETE]
    assert found.time[0, 0] > 1
    assert (found.separatrix[:, 0] % 2).tolist() == [sense > 0, sense < 0]


@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_agrees_a_crossing_right_after_the_start(engine: str, bits: int) -> None:
    """Where the lane, or the integrator, has just stopped at the crossing of another orbit."""
    states = fan(20 if bits == 53 else 1 if engine == "scipy" else 2)
    last_bit = 2.0 ** (1 - bits)
    states[0], states[2] = 1.0, -500 * last_bit
    found = find(states, engine, bits, n_crossings=1)
    # M3' is near 1/(2 sin(alpha0)).
    expected = 500 * last_bit * 2 * math.sin(FIG4.alpha0)
    np.testing.assert_allclose(found.time[0], expected, rtol=0.1)


class Ramp:
    """DOP853's interface over an orbit with M3 = (t - 1) `sense` in steps of 1, Qp = 1, Qm = -1."""

    def __init__(self, sense: int) -> None:
        self.sense, self.t, self.status = sense, 0.0, "running"
        self.y = self.at(0.0)

    def at(self, time: Any) -> Any:
        """States (6, 1) or (6, times) at a time."""
        M3 = self.sense * (np.atleast_1d(time) - 1)
        return np.array([M3 * 0 + 1, M3 * 0 - 1, M3, *np.zeros((3, M3.size))])

    def step(self) -> None:
        self.t_old, self.t = self.t, self.t + 1
        self.y = self.at(self.t).ravel()

    def dense_output(self) -> Any:
        return self.at


@pytest.mark.parametrize("sense", [1, -1])
def test_dop853_finds_a_crossing_just_where_two_steps_meet(
    sense: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scipy.integrate.DOP853", lambda *_, **__: Ramp(sense))
    found = find(Ramp(sense).y, "scipy", n_crossings=2, passage_limit=4)
    assert found.separatrix.tolist() == [[2 if sense > 0 else 1], [0]]
    assert found.time[0, 0] == pytest.approx(1, abs=1e-15)
