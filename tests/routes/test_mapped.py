"""Route codes by return maps: the same codes, and no wrong symbol called certain."""

from __future__ import annotations

import math
import threading
import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments.stress.honesty import spoilt
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map import MapError, ReturnMap, kernel, return_map
from rigidpend.orbits.return_map.build import FIRST, SECOND, THIRD
from rigidpend.routes import certainty, codes, mapped
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import ProblemError, RouteProblem
from rigidpend.routes.start import Scales
from tests.orbits.integrate.problems import FIG4, GENERIC

LIGHT = Body((2, 1, "1.5"), (1, 1, 0), "1e-6")
HEAVY = Body((2, 1, "1.5"), (1, 1, 0), "0.005")
FIG5 = Body((2, "1.5", "1.8"), (0, 1, 0), "0.01")
PHASES = np.linspace(0.01, 6.27, 120)
TASK: dict[str, Any] = {"h0": "1.3342", "J1_0": "1e-8", "n_symbols": 15}


def found(body: Body, phases: Any = PHASES, **more: Any) -> RouteCodes:
    return route_codes(body, phases, **{**TASK, **more})


@pytest.mark.parametrize(
    ("body", "J1_0", "more"),
    [
        pytest.param(FIG4, "1e-8", {}, id="Fig. 4"),
        pytest.param(FIG4, "1e-12", {}, id="J1 small", marks=pytest.mark.slow),
        pytest.param(FIG4, "1e-4", {}, id="J1 large", marks=pytest.mark.slow),
        pytest.param(LIGHT, "1e-8", {}, id="mu small"),
        pytest.param(HEAVY, "1e-6", {}, id="mu large", marks=pytest.mark.slow),
        pytest.param(GENERIC, "1e-8", {}, id="generic", marks=pytest.mark.slow),
        pytest.param(FIG5, "1e-9", {"n_symbols": 6}, id="Fig. 5", marks=pytest.mark.slow),
    ],
)
def test_agrees_codes_and_times_with_integration(
    body: Body, J1_0: str, more: dict[str, Any]
) -> None:
    by_map = found(body, PHASES[::4], J1_0=J1_0, method="map", **more)
    by_time = found(body, PHASES[::4], J1_0=J1_0, method="integration", **more)
    both = by_map.certain & by_time.certain
    assert both.mean() > 0.99
    assert (by_map.codes == by_time.codes)[both].all()
    assert by_map.by_map.mean() > 0.5, "not all left to integration"
    assert not by_time.by_map.any()
    np.testing.assert_allclose(by_map.crossing_time[0], by_time.crossing_time[0], atol=1e-12)
    late = np.abs(by_map.crossing_time - by_time.crossing_time)
    after = np.vstack((both[:1], both))
    assert late[after].max() < 20 * certainty.AGREEMENT


def test_the_maps_take_the_place_of_integration(integrations: list[Any]) -> None:
    """Nothing is integrated but the sample and what leaves the tables or stays uncertain."""
    random = np.random.default_rng(5).uniform(0, 6.28, 600)
    record = found(FIG4, random, n_symbols=6, method="map")
    left = int((~record.by_map).sum())
    assert record.by_map.mean() > 0.98
    # Two computations of each orbit of the sample, and up to three of what is left.
    sample = mapped.SAMPLE + mapped.LEAST_SAMPLE
    assert sum(x["orbits"] for x in integrations) <= 2 * sample + 3 * left, "of 600 orbits"


def test_few_orbits_take_maps_that_are_kept_where_a_problem_is_asked_for_often(
    integrations: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(codes, "_asked", {})
    phases = np.linspace(0.1, 6.2, codes.OFTEN // 3)
    kept = found(FIG4, phases, n_symbols=6, method="map")
    calls = []
    for _ in range(4):
        integrations.clear()
        record = found(FIG4, phases, n_symbols=6)
        calls.append((record, sum(x["orbits"] for x in integrations)))
    assert [bool(record.by_map.any()) for record, _ in calls] == [False, False, True, True]
    left = int((~kept.by_map).sum())
    assert left <= calls[3][1] <= 3 * left < calls[2][1] <= 3 * (mapped.LEAST_SAMPLE + left)
    assert all((record.codes == kept.codes).all() for record, _ in calls)
    # What is stored hangs on no cache, and without maps there is nothing to take.
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 6)
    assert not codes.codes_of(problem, phases, resolve(None, None, (53, 106))).by_map.any()
    monkeypatch.setattr(mapped, "is_kept", lambda *_: False)
    assert not found(FIG4, phases, n_symbols=6).by_map.any()


def test_where_maps_of_more_bits_do_not_settle_their_columns_are_integrated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[int] = []

    def in_doubles_only(*args: Any, **more: Any) -> ReturnMap:
        asked.append(more["bits"])
        if more["bits"] > 53:
            raise MapError("the tables do not settle")
        return return_map(*args, **more)

    monkeypatch.setattr(mapped, "return_map", in_doubles_only)
    given: dict[str, Any] = {"J1_0": "1e-6", "n_symbols": 15, "precisions": (53, 106)}
    phases = np.linspace(0, 6.2, 40)
    record = found(FIG4, phases, method="map", **given)
    risen = record.bits > 53
    assert risen.any()
    assert max(asked) > 53
    assert not record.by_map[risen].any()
    assert record.certain.all()
    assert (record.codes == found(FIG4, phases, method="integration", **given).codes).all()


@pytest.mark.parametrize(
    ("which", "size"), [("first", 1e-15), ("first", 1e-12), ("second", 1e-10), ("both", 1e-12)]
)
def test_no_wrong_symbol_is_certain_where_tables_are_spoilt(
    which: str, size: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    phases = np.random.default_rng(11).uniform(0, 6.28, 300)
    true = truth(phases)

    def damaged(*args: Any, **more: Any) -> ReturnMap:
        made, first = return_map(*args, **more), more["design"] == FIRST
        hit = which == "both" or (which == "first") == first
        return spoilt(made, size, 1 + first) if hit else made

    monkeypatch.setattr(mapped, "return_map", damaged)
    monkeypatch.setattr(mapped, "contradicted", lambda *_: np.array([], dtype=int))
    monkeypatch.setattr(certainty, "AGREEMENT", certainty.CLOSE)
    record = found(FIG4, phases, method="map", precisions=(53,))
    assert not (record.certain & (record.codes != true)).any()
    # What the tables are off by shows as a smaller share of certain symbols, nowhere else.
    assert (record.certain.mean() > 0.5) == (size < 1e-14)


_true: dict[int, Any] = {}


def truth(phases: Any) -> Any:
    """The symbols by integration, certain ones; 254 elsewhere, which equals no symbol."""
    if len(phases) not in _true:
        record = found(FIG4, phases, method="integration", precisions=(53, 64))
        assert record.certain.mean() > 0.99
        _true[len(phases)] = record.codes
    return _true[len(phases)]


def test_orbits_that_leave_the_tables_on_the_way_have_failed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    separatrix = np.array([[2, 2, 2, 0], [3, 3, 0, 0], [4, 0, 0, 0]], dtype=np.uint8)
    time = np.where(separatrix > 0, [[1.0], [2.0], [3.0]], np.nan)
    maps = object.__new__(mapped.Maps)

    def follow(_: Any, __: int, ___: Any, columns: Any) -> Any:
        return time[:, columns], separatrix[:, columns]

    monkeypatch.setattr(maps, "_program", lambda *_: None, raising=False)
    monkeypatch.setattr(maps, "_follow", follow, raising=False)
    record = maps.crossings(53, certainty.FIRST, np.arange(4))
    assert record.outcome.tolist() == [Outcome.COMPLETE] + [Outcome.FAILED] * 3
    np.testing.assert_array_equal(record.separatrix, separatrix)
    np.testing.assert_array_equal(record.time, time)


def test_orbits_in_blocks_cross_as_each_does_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 3)
    maps = mapped.Maps(problem, Phases(PHASES[:17]))

    def crossed(n: int) -> list[Any]:
        return [*maps.crossings(53, certainty.FIRST, np.arange(n))]

    alone = [maps.crossings(53, certainty.FIRST, np.array([k])) for k in range(17)]
    monkeypatch.setattr(mapped, "BLOCK", 8)
    for n in (1, 7, 8, 9, 16, 17):
        for together, parts in zip(crossed(n), zip(*alone[:n], strict=True), strict=True):
            np.testing.assert_array_equal(together, np.concatenate(parts, axis=-1))


@pytest.mark.parametrize("bits", [53, mapped.SHARPER, mapped.SHARPEST])
def test_sharper_maps_are_made_once_for_the_orbits_that_are_left_open(
    bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only where the tables are in pairs of doubles, and if they pay for those orbits alone."""
    maps, asked = object.__new__(mapped.Maps), []
    maps.problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 3)
    maps.orbits, maps.table_bits = 1000, bits

    def make(bits: int, most: float) -> None:
        asked.append((bits, most))
        if most < mapped.budget_in_pairs(maps.problem, 100):
            raise MapError("they do not pay")

    monkeypatch.setattr(maps, "_make", make, raising=False)
    pays = [maps.sharpen(share) for share in (0.05, 0.25, 0.25)]
    assert pays == [bits == mapped.SHARPEST, *[bits >= mapped.SHARPER] * 2]
    budgets = [mapped.budget_in_pairs(maps.problem, n) for n in (50, 250)]
    assert asked == [(mapped.SHARPEST, x) for x in budgets if bits == mapped.SHARPER]


@pytest.mark.parametrize(("share", "pays"), [(0.05, False), (0.25, True)])
def test_a_third_map_is_made_for_orbits_that_two_leave_doubtful(
    share: float, pays: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If it pays for these; else the next precision settles them, or integration in the last."""
    maps, columns = object.__new__(mapped.Maps), np.arange(20)
    maps.problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 3)
    maps.orbits, maps.table_bits, maps._lock = 1000, mapped.SHARPER, threading.Lock()
    maps.designs = two = [FIRST, SECOND]

    def make(bits: int, most: float, used: Any) -> None:
        assert (bits, used) == (mapped.SHARPER, [THIRD])
        if most < mapped.budget_in_pairs(maps.problem, 100):
            raise MapError("it does not pay")

    def whole(_: int, __: Scales, columns: Any) -> Crossings:
        one = np.ones((4, len(columns)))
        return Crossings(one, one.astype(np.uint8), np.full(len(columns), Outcome.COMPLETE))

    monkeypatch.setattr(maps, "_make", make, raising=False)
    monkeypatch.setattr(maps, "crossings", whole, raising=False)
    integrated: list[int] = []

    def integrate_(bits: int, scales: Scales, columns: Any) -> Crossings:
        integrated.append(bits)
        return whole(bits, scales, columns)

    compute, _ = mapped.with_maps(maps, integrate_, int(20 / share), (53, 106))
    assert np.isnan(compute(53, certainty.THIRD, columns).time).all(), (
        "the maps' own bits settle it"
    )
    assert maps.designs == two
    third = compute(mapped.SHARPER, certainty.THIRD, columns)
    expected = Outcome.COMPLETE if pays else Outcome.FAILED
    assert third.outcome.tolist() == [expected] * 20
    assert np.isnan(third.time).all() != pays
    assert maps.designs == [FIRST, SECOND, THIRD][: 2 + pays]
    assert not integrated
    maps.designs = [FIRST, SECOND]
    compute, _ = mapped.with_maps(maps, integrate_, 20, (53,))
    compute(53, certainty.THIRD, columns)
    assert integrated == [53], "nothing finer is to come"


def test_passages_that_take_long_ask_for_sharper_tables_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 3)
    tried: list[int] = []

    def make(bits: int, most: float) -> None:
        tried.append(bits)
        if bits > least:
            raise MapError("they do not settle")

    maps = object.__new__(mapped.Maps)
    maps.problem = problem
    monkeypatch.setattr(maps, "_make", make, raising=False)
    for rotations, least, expected in (
        (9.4, 64, [64]),
        (9.4, 53, [64, 53]),
        (9.6, 80, [80]),
        (9.6, 64, [80, 64]),
        (9.6, 53, [80, 64, 53]),
    ):
        tried.clear()
        monkeypatch.setattr(mapped, "passage_rotations", lambda _, x=rotations: x)
        maps._settle(math.inf)
        assert (tried, maps.table_bits) == (expected, least)
    least = 0
    with pytest.raises(MapError, match="settle"):
        maps._settle(math.inf)


def test_a_sample_of_all_orbits_is_integrated_in_doubles_and_of_few_in_more_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[int, tuple[int, ...]]] = []

    def compared(*given: Any) -> Any:
        asked.append((given[-1], given[-2]))
        return np.array([], dtype=int)

    monkeypatch.setattr(mapped, "contradicted", compared)
    found(FIG4, PHASES, method="map")
    assert asked == [(mapped.SAMPLE, (53,)), (mapped.LEAST_SAMPLE, (53, 106))]


def test_orbits_of_every_phase_begin_at_one_distance(monkeypatch: pytest.MonkeyPatch) -> None:
    maps, begun = object.__new__(mapped.Maps), []
    maps.problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 3)
    maps.starts = None
    phases = np.array([-2.0, 0.0, 1e-300, 3.0])

    def follow(_: Any, Qp: Any, phase: Any, *__: Any) -> Any:
        begun.append((Qp, phase))
        return SimpleNamespace(time=np.zeros((4, 4)), separatrix=np.ones((4, 4)))

    monkeypatch.setattr(maps, "_begin", lambda *_: (phases, 0 * phases), raising=False)
    monkeypatch.setattr(kernel, "follow", follow)
    design = mapped.DESIGNS[certainty.FIRST]
    maps._follow(None, 53, design, np.arange(4))  # type: ignore[arg-type]
    [(Qp, phase)] = begun
    assert Qp.tolist() == [mapped.start_Qp(maps.problem, design.unit, 53)] * 4
    assert phase is phases


@pytest.mark.parametrize(
    ("n", "size", "expected"),
    [(1, 5, [0]), (11, 3, [0, 5, 10]), (11, 2, [0, 10]), (4, 9, [0, 1, 2, 3])],
)
def test_the_sample_reaches_from_the_first_orbit_to_the_last(
    n: int, size: int, expected: list[int]
) -> None:
    asked: set[int] = set()
    certain, bits = np.ones((1, n), dtype=bool), np.full(n, 53, dtype=np.uint16)

    def integrated(_: int, __: Scales, columns: Any) -> Crossings:
        asked.update(columns.tolist())
        m = len(columns)
        whole = np.full((2, m), 2, dtype=np.uint8)
        return Crossings(np.ones((2, m)), whole, np.zeros(m, dtype=np.uint8))

    known = certainty.Decided(integrated(53, Scales(), np.arange(n)), certain, bits)
    asked.clear()
    assert not mapped.contradicted(known, integrated, 1.0, (53,), size).size
    assert sorted(asked) == expected


@pytest.mark.slow
def test_two_maps_err_independently_though_they_share_inputs() -> None:
    """An error of R times the difference is as rare as 1/R, with the truth in more bits."""
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 15)
    columns = np.arange(2048)
    maps = mapped.Maps(problem, Phases(np.random.default_rng(3).uniform(0, 6.28, columns.size)))
    one, other = (
        maps.crossings(53, scales, columns).time for scales in (certainty.FIRST, certainty.SECOND)
    )
    true = maps.crossings(maps.table_bits, certainty.SECOND, columns).time
    error, apart = np.abs(one - true)[2:], np.abs(one - other)[2:]
    large = (error > 1e-10) & (error < 0.1)
    shares = [float((error > R * apart)[large].mean()) * R for R in (3, 10, 30)]
    assert large.sum() > 1000
    assert min(shares) > 0.2
    assert max(shares) < 1.5


def test_few_orbits_are_integrated_and_many_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not found(FIG4, PHASES[:3], n_symbols=2).by_map.any()
    monkeypatch.setattr(codes, "MANY", 3)
    assert not found(FIG4, PHASES[:3], n_symbols=2).by_map.any(), "tables would not pay"
    monkeypatch.setattr(mapped, "budget", lambda *_: math.inf)
    assert found(FIG4, PHASES[:3], n_symbols=2).by_map.all()


def test_tables_pay_for_more_orbits_of_longer_passages() -> None:
    few, slow = (
        RouteProblem(Body(A, (1, 1, 0), "0.001"), exact("1.3342"), exact("1e-8"), 15)
        for A in ((2, 1, "1.5"), (2, "1.9", "1.95"))
    )
    assert mapped.budget(few, 20_000) == pytest.approx(20 * mapped.budget(few, 1000))
    assert mapped.budget(slow, 1000) > 3 * mapped.budget(few, 1000)
    for budget in (mapped.budget, mapped.budget_in_pairs):
        longer = budget(RouteProblem(few.body, few.h0, few.J1_0, 45), 1000)
        assert longer == pytest.approx(3 * budget(few, 1000)), "symbols are alike"


def test_tables_share_what_all_of_them_may_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 3)
    budgets: list[float] = []

    def refused(*_: Any, budget: float, **__: Any) -> ReturnMap:
        budgets.append(budget)
        raise MapError("refused")

    monkeypatch.setattr(mapped, "return_map", refused)
    monkeypatch.setattr(mapped, "expected_cost", lambda *x: 1.0 if x[-1] == FIRST else 3.0)
    for most, expected in ((3.9, set()), (8.0, {2.0})):
        monkeypatch.setattr(mapped, "budget", lambda *_, most=most: most)
        with pytest.raises(MapError):
            mapped.Maps(problem, Phases(PHASES), least_time=True)
        assert set(budgets) == expected


@pytest.mark.parametrize(("more", "designs"), [(0, [FIRST, SECOND, THIRD]), (1, [FIRST, SECOND])])
def test_a_third_map_is_made_at_once_from_so_many_orbits_on(
    monkeypatch: pytest.MonkeyPatch, more: int, designs: list[Any]
) -> None:
    monkeypatch.setattr(mapped, "THIRDS", len(PHASES) + more)
    monkeypatch.setattr(mapped.Maps, "_settle", lambda *_: None)
    monkeypatch.setattr(
        mapped.Maps, "crossings", lambda *_: SimpleNamespace(separatrix=np.ones((1, 1)))
    )
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 3)
    assert mapped.Maps(problem, Phases(PHASES)).designs == designs


def test_what_maps_leave_open_is_expected_to_go_beyond_pairs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 15)
    one = mapped.budget_in_pairs(problem, 1) / mapped.STAKE
    each = mapped.beyond_maps(problem)
    # Measured: 3.5 and 4.4 computations in pairs.
    assert 3.5 * one <= each <= 4.4 * one
    for limit, said in ((9.9 * each, True), (10.1 * each, False)):
        monkeypatch.setattr(mapped, "LONG", limit)
        monkeypatch.setattr(mapped, "SLOW", 0.0)
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            mapped._warned(problem, 10, 10, each, "because")
        assert bool(heard) == said
        if said:
            assert f"{1e6 * each:.2g} microseconds each" in str(heard[0].message)
            assert f"some {10 * each:.2g} s in all" in str(heard[0].message)


def test_orbits_are_expected_to_take_the_cheaper_way(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, costs = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 15), {}
    for cost in (1e-9, math.inf):
        monkeypatch.setattr(mapped, "expected_cost", lambda *_, cost=cost: cost)
        costs[cost] = mapped.expected_seconds(problem, 1000)
    saved = costs[math.inf] - costs[1e-9]
    assert saved == pytest.approx(mapped.budget(problem, 1000) / mapped.STAKE)


def test_where_passages_are_long_what_maps_leave_open_goes_to_sharper_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slow = Body(("2.908", "1.682", "1.764"), ("0.6", "0.8", 0), "0.0002")
    phases = np.random.default_rng(2).uniform(0, 6.28, 300)
    at_once = found(slow, phases, method="map")
    assert set(at_once.bits) == {53, mapped.SHARPEST}
    monkeypatch.setattr(mapped, "DEEP", math.inf)
    by_maps = found(slow, phases, method="map")
    assert (at_once.codes == by_maps.codes)[at_once.certain & by_maps.certain].all()
    open_ = by_maps.bits > mapped.SHARPER
    assert open_.any()
    assert (by_maps.bits[open_] > mapped.SHARPEST).all(), "for so few they do not pay"
    with monkeypatch.context() as patch:
        patch.setattr(mapped, "SLOW", 0.0)
        patch.setattr(mapped, "LONG", 0.0)
        said = rf"^{open_.sum()} of 300 orbits are integrated, .* more than the 64 bits of the maps"
        with pytest.warns(mapped.SlowRoutesWarning, match=said):
            found(slow, phases, method="map")
    monkeypatch.setattr(mapped, "budget_in_pairs", lambda *_: math.inf)
    sharper = found(slow, phases, method="map")
    assert sharper.by_map[open_].mean() > 0.8
    assert sharper.by_map[sharper.bits == mapped.SHARPEST].all()
    assert (sharper.codes == by_maps.codes)[sharper.certain & by_maps.certain].all()
    assert sharper.certain.all()
    no_sharper = found(slow, phases, method="map", precisions=(53, mapped.SHARPER))
    assert no_sharper.bits.max() <= mapped.SHARPER, "more bits are not asked for"


def test_orbits_that_are_integrated_for_long_come_with_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    symmetric = Body(("2.673", "2.520", "2.527"), (1, 1, 0), "0.004")
    problem = RouteProblem(symmetric, exact(1), exact("1e-8"), 15)
    with pytest.warns(
        mapped.SlowRoutesWarning, match=r"s in all: there are no return maps: because"
    ):
        mapped.told(problem, 20_000, "because")
    mapped.told(problem, 9, "because")
    quick = Body(("2.228", "0.561", "1.673"), (1, 1, 0), "0.018")
    mapped.told(RouteProblem(quick, exact(1), exact("1e-8"), 15), 1_000_000, "because")
    # Some 0.15 ms an orbit, half more than is told.
    between = RouteProblem(Body(FIG4.A, FIG4.r, "0.004"), exact(1), exact("1e-8"), 15)
    with pytest.warns(mapped.SlowRoutesWarning, match="^7000 of 7000 orbits are integrated, 1.5e"):
        mapped.told(between, 7000, "because")
    mapped.told(between, 6000, "because")
    monkeypatch.setattr(codes, "MANY", 1)
    monkeypatch.setattr(mapped, "LONG", 0)
    with pytest.warns(mapped.SlowRoutesWarning, match="nearly symmetric: its surfaces are split"):
        found(symmetric, PHASES[:1], h0=1, n_symbols=1, precisions=(53,))


def test_orbits_without_a_map_are_integrated_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    heavy = Body((2, 1, "1.5"), (1, 1, 0), "0.5")
    with pytest.raises(MapError):
        found(heavy, PHASES[:2], n_symbols=2, method="map")
    with pytest.raises(MapError, match="outside of the normal form"):
        found(FIG4, PHASES[:2], n_symbols=2, J1_0="0.3", method="map")
    monkeypatch.setattr(codes, "MANY", 1)
    assert not found(heavy, PHASES[:2], n_symbols=2).by_map.any()


def test_wrong_methods_are_refused() -> None:
    with pytest.raises(ProblemError, match="auto, map, integration"):
        found(FIG4, PHASES[:2], method="guess")
    with pytest.raises(ProblemError, match="begin with 53"):
        found(FIG4, PHASES[:2], method="map", precisions=(64, 113))
