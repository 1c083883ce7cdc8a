"""Maps of a run's orbits: which are made, of how many bits, and the crossings by them."""

import contextlib
import functools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
import pytest

from rigidpend.numbers.checked import GAP_BITS
from rigidpend.numbers.exact import PRECISIONS, context, exact
from rigidpend.orbits.integrate import Crossings
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map import MapError, ReturnMap, return_map
from rigidpend.orbits.return_map.build import FIRST, SECOND, THIRD, Design
from rigidpend.orbits.return_map.program import Program
from rigidpend.routes import certainty, choice, costs, mapped
from rigidpend.routes.phases import Phases
from rigidpend.routes.run import Run
from tests.bodies import problem

PHASES = np.linspace(0.01, 6.27, 120)
BOTH = certainty.FIRST_SCALES, certainty.SECOND_SCALES


def run(
    phases: Any = PHASES, n_symbols: int = 3, precisions: tuple[int, ...] = PRECISIONS, **more: Any
) -> Run:
    return Run(
        problem(n_symbols=n_symbols), Phases(phases), resolve(None, None, precisions), **more
    )


Asked: TypeAlias = list[tuple[int, Design, float]]
But: TypeAlias = Callable[..., Asked]


@pytest.fixture
def but(monkeypatch: pytest.MonkeyPatch) -> But:
    """Maps in doubles for any, but for bits in which none settles; gives what is asked for then."""

    def settle(*unsettled: int) -> Asked:
        asked: Asked = []

        def made(*given: Any, bits: int, design: Design, budget: float, **more: Any) -> ReturnMap:
            asked.append((bits, design, budget))
            if bits in unsettled:
                raise MapError("they do not settle")
            return return_map(*given, bits=53, design=design, **more)

        monkeypatch.setattr(mapped, "return_map", made)
        return asked

    return settle


@pytest.mark.parametrize(
    ("scales", "bits", "design"),
    [
        (certainty.FIRST_SCALES, 53, FIRST),
        (certainty.SECOND_SCALES, 53, SECOND),
        (certainty.FIRST_SCALES, 64, FIRST),
        (certainty.FIRST_SCALES, 75, SECOND),
    ],
)
def test_starts_are_those_of_the_exact_phases_in_every_precision(
    scales: Any, bits: int, design: Design, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Qp, psi of the mirrored start and the height, by closed forms in 200 bits."""
    phases = [exact(x) for x in ("0.1", "1.7", "3.3", "6.1", "123456789.3", "2*pi/3")]
    maps, columns, m = mapped.Maps(run(phases)), np.array([5, 0, 1, 2, 3, 4]), context(200)
    begun: list[Any] = []

    def follow(_: Program, *start: Any) -> Crossings:
        begun.extend(start)
        return Crossings(*np.zeros((3, 1)))

    monkeypatch.setattr("rigidpend.routes.mapped.kernel.follow", follow)
    maps.crossings(bits, scales, columns)
    Qps, psi, height, *_ = begun
    p, unit = maps.problem.body.angles(200), exact(design.unit).at(m.prec)
    J1, J2 = maps.problem.J1_0.at(m.prec), maps.problem.J2_0(200)
    theta2 = [phases[k].at(m.prec) for k in columns]
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


@pytest.mark.parametrize(
    ("rotations", "unsettled", "pair"),
    [
        (9.4, [], (64, 75)),
        (9.4, [75], (64, 72)),
        (9.4, [75, 72], (64, 53)),
        (9.4, [64], (53, 53)),
        (9.6, [], (82, 90)),
        (9.6, [90], (64, 75)),
        (9.6, [90, 75, 72], (82, 53)),
        (9.6, [82], (82, 90)),
        (9.6, [82, 90, 64], (53, 53)),
        (9.6, [82, 90, 64, 53], None),
    ],
)
def test_passages_that_take_long_ask_for_sharper_tables_and_what_does_not_settle_for_less(
    rotations: float, unsettled: list[int], pair: Any, but: But, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(costs, "passage_rotations", lambda _: rotations)
    asked = but(*unsettled)
    if pair is None:
        with pytest.raises(MapError, match="settle"):
            mapped.Maps(run())
        return
    maps, (first, second) = mapped.Maps(run()), pair
    # The first of 82 bits leaves out terms of tables as sharp as the second's.
    tables = second if pair == (82, 90) else first
    assert [x[:2] for x in asked[-2:]] == [(tables, FIRST), (second, SECOND)]
    # A first map as sharp as the second confirms it, and is then the last that was asked.
    every, deep = (FIRST, SECOND), pair == (82, 90)
    seconds = (SECOND, FIRST) if deep else (SECOND,)
    assert maps.by_bits == {first: (FIRST,), second: seconds} | {53: every}
    most = {first: 1, second: len(seconds)} | {53: 2 if first > 53 else 3}
    assert {rung.bits: rung.most for rung in maps.ladder} == most
    # In doubles alone the second one is the last.
    assert maps.last == (SECOND if pair in {(64, 75), (64, 72), (53, 53)} else FIRST)


def test_three_maps_are_made_where_these_decide_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """In doubles, of however few orbits: no sharper map follows, and integration takes long."""
    for wanted, maps in ((((64, 75), (53, 53)), 2), (((53, 53),), 3)):
        monkeypatch.setattr(costs, "wanted", lambda _, wanted=wanted: wanted)
        assert mapped.designs_of(problem(), 10) == [FIRST, SECOND, THIRD][:maps]


def test_each_of_two_maps_as_sharp_makes_one_computation_in_the_most_bits(monkeypatch: Any) -> None:
    """By one map twice, it would agree with itself; beside the last comes the second map's."""
    monkeypatch.setattr(costs, "passage_rotations", lambda _: costs.DEEP)
    maps, every = mapped.Maps(run()), np.arange(8)
    assert [maps.design_of(90, scales) for scales in BOTH] == [SECOND, FIRST]
    assert maps.last == FIRST
    one, last = (maps.crossings(90, scales, every) for scales in BOTH)
    assert (one.time != last.time).any(axis=0).all()
    first, *further = maps.beyond
    assert first.beside is not None
    np.testing.assert_array_equal(first.beside(every[::-2]).time, one.time[:, ::-2])
    assert not any(rung.beside for rung in further)


@pytest.mark.parametrize(
    ("precisions", "levels", "single"),
    [
        ((53, 75), [64, 75], {64}),
        # No nearer to what is asked for, and not beyond it.
        ((53, 82), [64], {64}),
        ((53, 83), [64, 75], {64, 75}),
        ((53, 64), [64], set()),
        ((53, 64, 106), [64, 75], {64, 75}),
        ((53, 70, 106), [], set()),
        ((53,), [], set()),
    ],
)
def test_one_map_of_each_number_of_bits_serves_beyond_doubles(
    precisions: tuple[int, ...], levels: list[int], single: set[int]
) -> None:
    maps, every = mapped.Maps(run(precisions=precisions)), certainty.SCALES
    assert sorted(maps.by_bits) == [53, *levels]
    assert maps.most_bits == max(levels, default=53)
    most = {rung.bits: rung.most for rung in maps.ladder}
    assert list(most) == sorted({53, *levels, *(x for x in precisions if x < maps.most_bits)})
    assert {bits for bits in levels if most[bits] == 1} == single
    # Where no map follows doubles integration makes a third computation in them.
    assert most[53] == 3 - bool(levels)
    assert most.get(precisions[-1], 3) == 3
    # The least sharp of both maps serves what is asked for last.
    last = FIRST, SECOND, None
    for bits, alone in ((64, FIRST), (75, SECOND), (106, None)):
        found = [maps.design_of(bits, scales) for scales in every]
        expected = last if (64, bits) == (precisions[-1], 64) else (alone, None, None)
        assert found == list(expected if bits in levels else (None,) * 3)
    assert [maps.design_of(53, scales) for scales in every] == list(last)


@pytest.mark.parametrize(
    ("rotations", "unsettled", "more", "precisions", "beyond"),
    [
        # Maps of 75 bits count for 83 beside an integration, and pairs of doubles for 97.
        (9.4, (), 0, PRECISIONS, {106: 14, 120: 14, 131: 11, 160: 29}),
        (9.4, (), 14, PRECISIONS, {106: 0, 120: 14, 131: 11, 160: 29}),
        # Then pairs would be less sharp than what is known.
        (9.4, (), 15, PRECISIONS, {109: 11, 120: 11, 131: 11, 160: 29}),
        # That of 75 bits counts for 83, or else that of 64 for 72.
        *((9.4, (), 0, (53, bits), {bits: more}) for bits, more in ((94, 11), (83, 0), (82, 10))),
        # Those of 72 count for 80, those of 64 for 72, and doubles for doubles.
        (9.4, (75,), 0, PRECISIONS, {88: 8, 106: 9, 120: 14, 131: 11, 160: 29}),
        (9.4, (75,), 0, (53, 91), {91: 11}),
        (9.4, (75, 72), 0, PRECISIONS, {88: 16, 106: 9, 120: 14, 131: 11, 160: 29}),
        (9.4, (64,), 0, PRECISIONS, {64: 11, 76: 12, 88: 12, 106: 9, 120: 14, 131: 11, 160: 29}),
        (9.4, (64,), 0, (53, 64), {64: 11}),
        # Two maps of 90 bits count for 90. Where both confirm pairs, these have to keep seven bits
        # more than the maps count for.
        (9.6, (), 0, PRECISIONS, {106: 7, 120: 14, 131: 11, 160: 29}),
        (9.6, (), 1, PRECISIONS, {109: 18, 120: 11, 131: 11, 160: 29}),
        # Where passages are very deep pairs keep 97 bits beside what is sharper.
        (19.9, (), 0, PRECISIONS, {106: 7, 120: 14, 131: 11, 160: 29}),
        (20.0, (), 0, PRECISIONS, {106: 7, 109: 12, 120: 11, 131: 11, 160: 29}),
        (20.0, (), 1, PRECISIONS, {109: 18, 120: 11, 131: 11, 160: 29}),
        (20.0, (), 2, PRECISIONS, {109: 17, 120: 11, 131: 11, 160: 29}),
        (20.0, (), 3, PRECISIONS, {109: 16, 120: 11, 131: 11, 160: 29}),
        # The first map alone, where 90 bits are too near to what is asked for.
        (20.0, (), 0, (53, 97, 160), {97: 7, 109: 12, 120: 11, 131: 11, 160: 29}),
        (9.6, (), 2, (53, 97, 160), {97: 5, 109: 12, 120: 11, 131: 11, 160: 29}),
    ],
)
def test_integrations_are_sharper_than_maps_by_the_bits_for_which_both_count(
    rotations: float, unsettled: Any, more: int, precisions: Any, beyond: Any, but: But
) -> None:
    """A map of a narrower layer holds as many digits of d more."""
    but(*unsettled)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(costs, "passage_rotations", lambda _: rotations)
        maps = mapped.Maps(run(precisions=precisions))
        patch.setattr(mapped, "narrower", lambda _: more)
        found = maps.beyond
    assert {rung.bits: rung.more for rung in found} == beyond
    # One computation is made in each but the last.
    assert [rung.most for rung in found] == [*[1] * (len(found) - 1), 3]
    # Both maps confirm what is less than 17 bits sharper.
    twice = maps.most_bits == 90 and found[0].more < 17
    assert [rung.beside is not None for rung in found] == [twice, *[False] * (len(found) - 1)]


def test_all_maps_of_a_problem_are_those_of_its_layer(monkeypatch: pytest.MonkeyPatch) -> None:
    """As they are looked for, estimated, made here or in another process, and used."""
    asked = list[tuple[str, int]]()

    def watched(name: str, found: Any) -> None:
        def called(*given: Any, **more: Any) -> Any:
            design = next(x for x in (*given, *more.values()) if isinstance(x, Design))
            asked.append((name, design.narrower))
            return found(design) if name == "return_map" else found

        monkeypatch.setattr(mapped, name, called)

    task = run(jobs=2)
    for name, found in (("is_kept", False), ("expected_cost", 1.0), ("build_apart", None)):
        watched(name, found)
    given: Any = {"h": task.problem.energies, "bits": 53}
    whole = functools.partial(return_map, task.problem.body, **given)
    watched("return_map", lambda design: whole(design=design._replace(narrower=0)))
    monkeypatch.setattr(mapped, "narrower", lambda _: 2)
    mapped.Maps(task)
    mapped.expected_tables(task.problem, 10, math.inf)
    every = {"is_kept", "expected_cost", "build_apart", "return_map"}
    assert set(asked) == {(name, 2) for name in every}


def test_the_first_map_alone_serves_what_is_asked_for_last_where_the_second_is_in_doubles(
    but: But,
) -> None:
    but(75, 72)
    maps = mapped.Maps(run(precisions=(53, 64)))
    assert maps.by_bits == {64: (FIRST,), 53: (FIRST, SECOND)}


@pytest.mark.parametrize(
    ("precisions", "served"),
    [
        ((53, 82), [82]),
        ((53, 89, 160), []),
        ((53, 90), [82, 90]),
        ((53, 97), [82]),
        ((53, 98), [82, 90]),
        ((53, 80, 160), [90]),
    ],
)
def test_maps_of_deep_passages_serve_that_are_eight_bits_from_what_is_asked_for(
    precisions: tuple[int, ...], served: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(costs, "passage_rotations", lambda _: costs.DEEP)
    maps = mapped.Maps(run(precisions=precisions))
    assert sorted(maps.by_bits) == [53, *served]
    # Integration makes two computations in what is asked for between, or three in the last.
    most = {rung.bits: rung.most for rung in maps.ladder}
    assert most.get(80, 2) == 2
    assert most.get(precisions[-1], 3) == 3
    assert bool(maps.beyond) == (precisions[-1] > maps.most_bits)


@pytest.mark.parametrize(("precisions", "most"), [(PRECISIONS, [1, 1]), ((53, 64), [1, 3])])
def test_a_second_map_in_doubles_computes_nothing_where_it_would_decide_few(
    precisions: tuple[int, ...], most: list[int], but: But, monkeypatch: Any
) -> None:
    asked = but()
    monkeypatch.setattr(costs, "doubles_decide", lambda _: False)
    maps = mapped.Maps(run(task_orbits=mapped.THIRDS, precisions=precisions))
    assert [rung.most for rung in maps.ladder[:2]] == most
    assert all(x[1] != THIRD for x in asked), "nor does a third one"


def test_maps_in_doubles_decide_alone_where_nothing_follows(but: But, monkeypatch: Any) -> None:
    """Of many orbits a third one, however few it is expected to decide: it spares integration."""
    but()
    monkeypatch.setattr(costs, "doubles_decide", lambda _: False)
    for orbits, served in ((mapped.THIRDS - 1, False), (mapped.THIRDS, True)):
        maps = mapped.Maps(run(task_orbits=orbits, precisions=(53,)))
        assert [rung.most for rung in maps.ladder] == [3]
        assert maps.design_of(53, certainty.THIRD_SCALES) == (THIRD if served else None)
        # With it or without, what is known counts as the second one's.
        assert maps.last == SECOND
    monkeypatch.setattr(mapped, "expected_cost", lambda *x: x[-2])
    given = run().problem, mapped.THIRDS, math.inf
    assert mapped.expected_tables(*given) < mapped.expected_tables(*given, (53,))


def test_a_third_map_is_made_at_once_from_so_many_orbits_on(but: But, monkeypatch: Any) -> None:
    asked, counts = but(), (mapped.THIRDS - 1, mapped.THIRDS)
    assert [mapped.Maps(run(task_orbits=n)).ladder[0].most for n in counts] == [2, 3]
    # Its bits are those of the first's computation.
    assert [x[:2] for x in asked if x[1] == THIRD] == [(64, THIRD)]
    deep = mapped.tasks_of([FIRST, SECOND, THIRD], (82, 90))
    assert deep == [(90, FIRST), (90, SECOND), (82, THIRD)]
    monkeypatch.setattr(mapped, "expected_cost", lambda *x: x[-2])
    tables = [mapped.expected_tables(run().problem, n, math.inf) for n in counts]
    assert tables == [64 + 75, 64 + 75 + 64]


@pytest.mark.parametrize("decide", [True, False])
@pytest.mark.parametrize("design", [FIRST, SECOND])
def test_no_wrong_symbol_is_certain_by_one_map_whose_tables_are_wrong(
    design: Design, decide: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def made(*given: Any, **more: Any) -> ReturnMap:
        one = return_map(*given, **more)
        if more["design"] != design:
            return one
        down, up = one.charts
        table = up.inverse._replace(values=up.inverse.values * (1 + 1e-5))
        return replace(one, charts=(down, up._replace(inverse=table)))

    task, found = run(n_symbols=15, precisions=(53, 106)), []
    monkeypatch.setattr(costs, "doubles_decide", lambda _: decide)
    for making in (return_map, made):
        monkeypatch.setattr(mapped, "return_map", making)
        found.append(choice.by_maps(mapped.Maps(task), sampled=False))
    right, wrong = found
    assert right.certain.all()
    other = wrong.crossings.separatrix[:-1] != right.crossings.separatrix[:-1]
    assert not (wrong.certain & other).any()


@pytest.mark.slow
def test_two_maps_err_independently_though_they_share_inputs() -> None:
    """An error of R times the difference is as rare as 1/R, with the truth in more bits."""
    columns = np.arange(2048)
    phases = np.random.default_rng(3).uniform(0, 6.28, columns.size)
    maps = mapped.Maps(run(phases, 15))
    one, other = (maps.crossings(53, scales, columns).time for scales in BOTH)
    true = maps.crossings(maps.most_bits, certainty.FIRST_SCALES, columns).time
    error, apart = np.abs(one - true)[2:], np.abs(one - other)[2:]
    large = (error > 1e-10) & (error < 0.1)
    shares = [float((error > R * apart)[large].mean()) * R for R in (3, 10, 30)]
    assert large.sum() > 1000
    assert 0.2 < min(shares) <= max(shares) < 1.5


def test_maps_by_name_have_no_tables_that_take_minutes_beyond_doubles(
    but: But, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those in doubles are made whatever they take, and sharper ones where they pay."""
    asked = but(64)
    for each in (0.49 * mapped.LEAST_BUDGET, 0.51 * mapped.LEAST_BUDGET):
        monkeypatch.setattr(mapped, "expected_cost", lambda *_, each=each: each)
        mapped.Maps(run())
    # Each that was made is asked for once more, when it is used.
    budgets = [(bits, budget) for bits, _, budget in asked]
    assert budgets == [(64, mapped.LEAST_BUDGET / 2)] * 3 + [(53, math.inf)] * 8
    mapped.Maps(run(task_orbits=10**7))
    assert asked[11][2] == pytest.approx(costs.budget(run().problem, 10**7) / 3)


@pytest.mark.parametrize(
    ("jobs", "expected", "apart"),
    [
        (2, {FIRST: 0.1, SECOND: 1.01 * mapped.LEAST_APART}, [FIRST]),
        (2, {FIRST: 1.01 * mapped.LEAST_APART, SECOND: 0.1}, [SECOND]),
        (2, {FIRST: 0.1, SECOND: 0.99 * mapped.LEAST_APART}, []),
        (1, {FIRST: 1.0, SECOND: 2.0}, []),
        # The shortest of three is made here too, after the longest.
        (2, {FIRST: 1.0, SECOND: 3.0, THIRD: 2.0}, [THIRD]),
    ],
)
def test_tables_share_what_they_may_cost_and_the_longest_is_made_here_the_other_beside_it(
    jobs: int, expected: Any, apart: Any, but: But, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, there, total = but(), list[tuple[Design, float]](), sum(expected.values())
    monkeypatch.setattr(mapped, "is_kept", lambda *_: False)
    monkeypatch.setattr(mapped, "expected_cost", lambda *x: expected[x[-1]])
    monkeypatch.setattr(mapped, "build_apart", lambda *x: there.append(x[-2:]))
    orbits = mapped.THIRDS if THIRD in expected else 1
    for budget in (0.99 * total, 8.0):
        monkeypatch.setattr(costs, "budget", lambda *_, budget=budget: budget)
        with contextlib.suppress(MapError):
            mapped.Maps(run(jobs=jobs, task_orbits=orbits), least_time=True)
    shares = {design: 8.0 * (each / total) for design, each in expected.items()}
    assert {x[1:] for x in asked} == set(shares.items())
    assert there == [(design, shares[design]) for design in apart]


def test_a_map_leaves_out_as_much_as_the_other_errs(monkeypatch: pytest.MonkeyPatch) -> None:
    def spoilt(*given: Any, **more: Any) -> ReturnMap:
        made = return_map(*given, **more)
        worse = made.errors._replace(inverse=2.0**-60)
        return replace(made, errors=worse) if more["design"] == SECOND else made

    monkeypatch.setattr(mapped, "return_map", spoilt)
    allowed, program = dict[int, float](), ReturnMap.program

    def watched(made: ReturnMap, bits: int, least: Any, most: Any, coarse: float) -> Program:
        allowed[bits] = coarse
        return program(made, bits, least, most, coarse)

    monkeypatch.setattr(ReturnMap, "program", watched)
    maps = mapped.Maps(run(task_orbits=1000))
    for bits in (64, 75):
        maps.crossings(bits, certainty.FIRST_SCALES, np.arange(1))
    assert allowed == {53: 0.0, 64: 2.0 ** (GAP_BITS - 60) / 12, 75: 0.0}
    # The other does not, in as few bits.
    maps = mapped.Maps(run(precisions=(53, 64)))
    maps.crossings(64, certainty.SECOND_SCALES, np.arange(1))
    assert allowed[64] == 0.0


def test_none_is_made_where_kept_ones_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mapped, "is_kept", lambda *x: x[-1] == FIRST)
    with pytest.raises(MapError, match="none is kept"):
        mapped.Maps(run(), only_kept=True)
