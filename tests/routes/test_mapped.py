"""Maps of a run's orbits: which are made, of how many bits, and the crossings by them."""

from __future__ import annotations

import math
import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.body import Body
from rigidpend.numbers.checked import GAP
from rigidpend.numbers.exact import PRECISIONS, context, exact
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map import MapError, ReturnMap
from rigidpend.orbits.return_map.build import FIRST, SECOND, THIRD, Design
from rigidpend.orbits.return_map.program import Program
from rigidpend.routes import certainty, choice, costs, mapped
from rigidpend.routes.phases import Phases
from rigidpend.routes.run import Run
from rigidpend.routes.start import Scales
from tests.bodies import problem

GENTLE = Body(("2.908", "1.682", "1.764"), ("0.6", "0.8", 0), "0.0002")
"""Passages take long, and errors grow far."""
PHASES = np.linspace(0.01, 6.27, 120)


def run(
    phases: Any = PHASES, n_symbols: int = 3, precisions: tuple[int, ...] = PRECISIONS, **more: Any
) -> Run:
    return Run(
        problem(n_symbols=n_symbols), Phases(phases), resolve(None, None, precisions), **more
    )


def unmade(bits: int = costs.SHARPER, second: int = 53, **more: Any) -> Any:
    """Maps of which none is made."""
    maps: Any = object.__new__(mapped.Maps)
    maps.run, maps._lock, maps._budgets = run(**more), threading.Lock(), {}
    maps.kept = False
    maps.problem, maps.designs = maps.run.problem, [FIRST, SECOND]
    maps._use((bits, second))
    return maps


def test_orbits_cross_together_as_each_does_alone() -> None:
    maps = mapped.Maps(run(PHASES[:17]))
    alone = [maps.crossings(53, certainty.FIRST, np.array([k])) for k in range(17)]
    for n in (1, 7, 8, 9, 16, 17):
        crossed = maps.crossings(53, certainty.FIRST, np.arange(n))
        for together, parts in zip(crossed, zip(*alone[:n], strict=True), strict=True):
            np.testing.assert_array_equal(together, np.concatenate(parts, axis=-1))


@pytest.mark.parametrize(
    ("design", "bits"), [(FIRST, 53), (SECOND, 53), (THIRD, 64), (FIRST, 64), (SECOND, 75)]
)
def test_starts_are_those_of_the_exact_phases_in_every_precision(design: Design, bits: int) -> None:
    """Qp, psi of the mirrored start and the height, by closed forms in 200 bits."""
    phases = [exact(x) for x in ("0.1", "1.7", "3.3", "6.1", "123456789.3", "2*pi/3")]
    maps, columns, m = unmade(second=75, phases=phases), np.array([5, 0, 1, 2, 3, 4]), context(200)
    Qps, psi, height = maps._begin(bits, design, columns)
    p, unit = maps.problem.body.angles(200), exact(design.unit).in_context(m)
    J1, J2 = maps.problem.J1_0.in_context(m), maps.problem.J2_0(200)
    theta2 = [phases[k].in_context(m) for k in columns]
    turned = [m.pi / 2 - p.beta0 / 2 - x for x in theta2]
    lower = [m.sin(x) for x in theta2]
    upper = [m.sin(p.alpha0 + p.beta0 + x) for x in theta2]
    Qp = 2 * unit * m.sqrt(J1 * (J2 - J1)) * m.sin(p.alpha0)

    def off(found: Any, expected: Any) -> list[Any]:
        parts = found.parts if bits > 53 else np.asarray(found)[None]
        exactly = [m.fsum(x) for x in parts.reshape(len(parts), -1).T.tolist()]
        return [x - y for x, y in zip(exactly, expected, strict=True)]

    allowed = 2.0 ** (4 - bits)
    whole = [x / (2 * m.pi) for x in off(psi, turned)]
    assert max(abs(x - m.nint(x)) for x in whole) < allowed
    heights = [(J1 * high + (J2 - J1) * low) / J2 for high, low in zip(upper, lower, strict=True)]
    assert max(map(abs, off(height, heights))) < allowed
    assert max(map(abs, off(Qps, [Qp] * len(columns)))) < allowed * Qp


def test_one_map_of_each_number_of_bits_serves_beyond_doubles() -> None:
    first, second = costs.SHARPER, costs.SHARPER + costs.CLOSEST
    maps = unmade(second=second, precisions=(53, 106))
    assert maps.levels == {first: FIRST, second: SECOND}
    assert (maps.ladder, maps.most_bits) == ((53, first, second, 106), second)
    for scales, served in (
        (certainty.FIRST, [True, True, True, False]),
        (certainty.SECOND, [True, True, False, False]),
        (certainty.THIRD, [False] * 4),
    ):
        assert [maps.serve(x, scales) for x in (53, first, second, 106)] == served
    assert not unmade().serve(first, certainty.SECOND), "the second has no more than doubles"
    # No nearer to what is asked for, and not beyond it.
    for precisions, levels, single in (
        ((53, second), [first, second], {first}),
        ((53, second + costs.CLOSEST - 1), [first], {first}),
        ((53, second + costs.CLOSEST), [first, second], {first, second}),
        ((53, first), [first], set()),
        ((53, first, 106), [first, second], {first, second}),
        ((53, first + 6, 106), [], set()),
        ((53,), [], set()),
    ):
        maps = unmade(second=second, precisions=precisions)
        assert [maps.most(x) for x in (53, precisions[-1])] == [2 + (precisions == (53,)), 3]
        assert (sorted(maps.levels), {x for x in levels if maps.most(x) == 1}) == (levels, single)
        assert maps.most_bits == max(levels, default=53)
    assert unmade(costs.SHARPEST).levels == {costs.SHARPEST: FIRST}
    assert unmade(53).ladder == PRECISIONS


@pytest.mark.slow
def test_what_two_maps_of_different_bits_differ_by_is_what_the_first_errs_by(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The second errs by 2^-11 of that as a rule, by half hardly ever; a sharper one is the truth.

    Where the first is right by chance, it errs by no more than twice what they differ by.
    """
    phases = Phases(np.random.default_rng(2).uniform(0, 6.28, 256))
    sharp = mapped.Maps(Run(problem(GENTLE), phases, resolve()))
    monkeypatch.setattr(costs, "DEEP", math.inf)
    maps = mapped.Maps(Run(problem(GENTLE), phases, resolve()))
    assert (maps.pair, sharp.pair) == ((64, 75), (82, 90))
    first, second, true = (
        made.crossings(bits, certainty.FIRST, np.arange(256)).time[-1]
        for made, bits in ((maps, 64), (maps, 75), (sharp, 90))
    )
    error, left = np.abs(first - true), np.abs(second - true)
    large = (error > 1e-9) & (error < 0.1)
    assert large.sum() > 50
    assert np.median(left[large] / error[large]) < 2.0 ** (1 - GAP)
    assert (left[large] > error[large] / 2).mean() < 0.02
    assert (error[large] / np.abs(first - second)[large]).max() < 2


def test_what_maps_do_not_serve_is_left_to_more_bits_or_integrated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    maps, columns, integrated = unmade(of=1000), np.arange(5, 25), list[Any]()

    def leaves(_: int, __: Scales, here: Any) -> Crossings:
        one = np.ones((4, len(here)))
        found = Crossings(one, one.astype(np.uint8), np.full(len(here), Outcome.COMPLETE))
        found.time[:, 3], found.outcome[3] = np.nan, Outcome.FAILED
        return found

    def integrate_(bits: int, _: Scales, here: Any) -> Crossings:
        integrated.append((bits, list(here)))
        one = np.ones((4, len(here)))
        return Crossings(one, one.astype(np.uint8), np.full(len(here), Outcome.COMPLETE))

    monkeypatch.setattr(maps, "crossings", leaves, raising=False)
    assert maps.most(53) == 2, "more bits settle what a third one would"
    compute, left = choice.with_maps(maps, integrate_, (53,))
    assert (compute(53, certainty.FIRST, columns).time == 1).all(), "what left tables is put back"
    assert integrated == [(53, [8])]
    assert np.flatnonzero(left).tolist() == [8], "and nothing else"
    compute(53, certainty.THIRD, columns[:2])
    assert integrated[1:] == [(53, [5, 6])]
    assert np.flatnonzero(left).tolist() == [5, 6, 8]


@pytest.mark.parametrize(
    ("rotations", "least", "expected"),
    [
        (9.4, (64, 75), [(64, 75)]),
        (9.4, (64, 72), [(64, 75), (64, 72)]),
        (9.4, (53, 53), [(64, 75), (64, 72), (64, 53), (53, 53)]),
        (9.6, (82, 90), [(82, 90)]),
        (9.6, (64, 75), [(82, 90), (82, 53), (64, 75)]),
        (9.6, (53, 53), [(82, 90), (82, 53), (64, 75), (64, 72), (64, 53), (53, 53)]),
    ],
)
def test_passages_that_take_long_ask_for_sharper_tables_at_once(
    rotations: float,
    least: tuple[int, int],
    expected: list[tuple[int, int]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    maps, tried = unmade(), []
    monkeypatch.setattr(costs, "passage_rotations", lambda _: rotations)

    def make(pair: tuple[int, int], most: float) -> None:
        tried.append(pair)
        if pair > least:
            raise MapError("they do not settle")

    monkeypatch.setattr(maps, "_make", make, raising=False)
    maps._settle(math.inf, math.inf)
    assert (tried, maps.pair) == (expected, least)
    least = 0, 0
    with pytest.raises(MapError, match="settle"):
        maps._settle(math.inf, math.inf)


@pytest.mark.slow
def test_two_maps_err_independently_though_they_share_inputs() -> None:
    """An error of R times the difference is as rare as 1/R, with the truth in more bits."""
    columns = np.arange(2048)
    phases = np.random.default_rng(3).uniform(0, 6.28, columns.size)
    maps = mapped.Maps(run(phases, 15))
    one, other = (
        maps.crossings(53, scales, columns).time for scales in (certainty.FIRST, certainty.SECOND)
    )
    true = maps.crossings(maps.most_bits, certainty.FIRST, columns).time
    error, apart = np.abs(one - true)[2:], np.abs(one - other)[2:]
    large = (error > 1e-10) & (error < 0.1)
    shares = [float((error > R * apart)[large].mean()) * R for R in (3, 10, 30)]
    assert large.sum() > 1000
    assert min(shares) > 0.2
    assert max(shares) < 1.5


def test_tables_share_what_all_of_them_may_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    budgets: set[tuple[Design, float]] = set()

    def refused(*_: Any, design: Design, budget: float, **__: Any) -> None:
        budgets.add((design, budget))
        if design == SECOND:
            raise MapError("refused")

    monkeypatch.setattr(mapped, "return_map", refused)
    monkeypatch.setattr(mapped, "expected_cost", lambda *x: 1.0 if x[-1] == FIRST else 3.0)
    for most, expected in ((3.9, set()), (8.0, {(FIRST, 2.0), (SECOND, 6.0)})):
        monkeypatch.setattr(costs, "budget", lambda *_, most=most: most)
        with pytest.raises(MapError):
            mapped.Maps(run(), least_time=True)
        assert budgets == expected


def test_maps_by_name_have_no_tables_that_take_minutes_beyond_doubles(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Those in doubles are made whatever they take, and sharper ones where they pay."""
    asked: list[tuple[int, float]] = []

    def refused(*_: Any, bits: int, budget: float, **__: Any) -> None:
        asked.append((bits, budget))
        raise MapError("refused")

    monkeypatch.setattr(mapped, "return_map", refused)
    for share in (0.49, 0.51):
        each = share * mapped.PATIENCE
        monkeypatch.setattr(mapped, "expected_cost", lambda *_, each=each: each)
        with pytest.raises(MapError, match="refused"):
            mapped.Maps(run())
    assert asked == [(64, mapped.PATIENCE / 2)] * 3 + [(53, math.inf)] * 2
    with pytest.raises(MapError, match="refused"):
        mapped.Maps(run(of=10**7))
    bits, budget = asked[5]
    assert bits == 64
    assert budget == pytest.approx(costs.budget(run().problem, 10**7) / 3)


@pytest.mark.parametrize(
    ("jobs", "expected", "apart"),
    [
        (2, {FIRST: 0.1, SECOND: 1.01 * mapped.APART}, [FIRST]),
        (2, {FIRST: 1.01 * mapped.APART, SECOND: 0.1}, [SECOND]),
        (2, {FIRST: 0.1, SECOND: 0.99 * mapped.APART}, []),
        (1, {FIRST: 1.0, SECOND: 2.0}, []),
    ],
)
def test_the_longest_map_is_made_here_and_the_other_beside_it_where_that_pays(
    jobs: int, expected: dict[Design, float], apart: list[Design], monkeypatch: pytest.MonkeyPatch
) -> None:
    maps, there = unmade(jobs=jobs), list[Design]()

    def elsewhere(_: Any, __: Any, ___: int, design: Design, budget: float) -> None:
        assert budget == 8 * expected[design] / sum(expected.values())
        there.append(design)

    monkeypatch.setattr(mapped, "is_kept", lambda *_: False)
    monkeypatch.setattr(mapped, "expected_cost", lambda *x: expected[x[-1]])
    monkeypatch.setattr(mapped, "return_map", lambda *_, **__: None)
    monkeypatch.setattr(mapped, "build_apart", elsewhere)
    maps._make((64, 72), 8.0)
    assert there == apart


def test_the_first_map_errs_by_more_where_the_second_is_less_sharp_than_planned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, second = costs.SHARPER, costs.SHARPER + GAP

    def terms() -> list[int]:
        maps = mapped.Maps(run(of=1000))
        each = (first, FIRST), (second, SECOND), (53, FIRST)
        return [maps._program(*one).values.shape[1] for one in each]

    planned, real = terms(), mapped.Maps.made

    def spoilt(maps: mapped.Maps, bits: int, design: Design) -> ReturnMap:
        made = real(maps, bits, design)
        worse = made.errors._replace(inverse=2.0**-60)
        return replace(made, errors=worse) if design == SECOND else made

    monkeypatch.setattr(mapped.Maps, "made", spoilt)
    allowed, program = list[float](), ReturnMap.program

    def watched(made: ReturnMap, bits: int, least: Any, most: Any, coarse: float) -> Program:
        allowed.append(coarse)
        return program(made, bits, least, most, coarse)

    monkeypatch.setattr(ReturnMap, "program", watched)
    less = terms()
    assert less[0] < less[1] < planned[1]
    assert less[0] < planned[0]
    assert less[2] == planned[2]
    # A fourth of its error is what the second map does without.
    assert sorted({*allowed}) == [0.0, 2.0 ** (GAP - 62)]


def test_maps_that_are_not_all_kept_are_made_by_nobody_who_asks_for_kept_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mapped, "is_kept", lambda *x: x[-1] == FIRST)
    with pytest.raises(MapError, match="none is kept"):
        mapped.Maps(run(), kept=True)


def test_a_third_map_is_made_at_once_from_so_many_orbits_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    counts = mapped.THIRDS - 1, mapped.THIRDS
    designs = [mapped.designs_of(n) for n in counts]
    # Its bits are those of the first.
    monkeypatch.setattr(mapped, "expected_cost", lambda *x: x[-2])
    tables = [mapped.expected_tables(run().problem, n, math.inf) for n in counts]
    assert tables == [64 + 75, 64 + 75 + 64]
    assert designs == [[FIRST, SECOND], [FIRST, SECOND, THIRD]]
    maps = unmade()
    for maps.designs, most in zip(designs, (2, 3), strict=True):
        assert maps.most(53) == most
