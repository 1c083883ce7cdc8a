"""Maps or integration: who is asked, what maps leave open, and that they agree."""

import math
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import Body, RouteCodes, route_codes
from rigidpend.machine.wording import seconds
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.states import at_crossings
from rigidpend.orbits.return_map import MapError, ReturnMap, return_map
from rigidpend.routes import certainty, choice, codes, costs, handover, mapped
from rigidpend.routes.cells import cells_of_starts
from rigidpend.routes.certainty import Contradiction
from rigidpend.routes.ladder import rungs
from rigidpend.routes.phases import Phases
from rigidpend.routes.run import Run
from rigidpend.routes.start import Scales
from rigidpend.routes.symbolic.levels import orbits_of
from tests.bodies import problem
from tests.orbits.integrate.problems import FIG4

LIGHT = Body((2, 1, "1.5"), (1, 1, 0), "1e-6")
PHASES = np.linspace(0.01, 6.27, 120)
PROBLEM = problem(n_symbols=3)


def found(phases: Any = PHASES, body: Body = FIG4, **more: Any) -> RouteCodes:
    task = {"h0": "1.3342", "J1_0": "1e-8", "n_symbols": 15, **more}
    return route_codes(body, phases, **task)


@pytest.fixture
def eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """Maps pay for any orbit."""
    monkeypatch.setattr(costs, "LEAST_SECONDS", 0.0)
    monkeypatch.setattr(costs, "budget", lambda *_: math.inf)


@pytest.fixture
def samples(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, tuple[int, ...]]]:
    """Sizes and precisions of the samples that are integrated from now on."""
    asked: list[tuple[int, tuple[int, ...]]] = []

    def compared(*given: Any) -> Any:
        asked.append((given[-1].size, given[-2]))
        return np.array([], dtype=int), True

    monkeypatch.setattr(choice, "contradicted", compared)
    return asked


@pytest.mark.parametrize(("body", "J1_0"), [(FIG4, "1e-8"), (LIGHT, "1e-12")])
def test_agrees_codes_and_times_with_integration(body: Body, J1_0: str) -> None:
    by_map, by_time = (
        found(PHASES[::4], body, J1_0=J1_0, method=method) for method in ("map", "integration")
    )
    both = by_map.certain & by_time.certain
    assert both.mean() > 0.99
    assert (by_map.codes == by_time.codes)[both].all()
    assert by_map.by_map.mean() > 0.5, "not all left to integration"
    assert not by_time.by_map.any()
    np.testing.assert_allclose(by_map.crossing_time[0], by_time.crossing_time[0], atol=1e-12)
    late = np.abs(by_map.crossing_time - by_time.crossing_time)
    after = np.vstack((both[:1], both))
    assert late[after].max() < 20 * certainty.LIMIT_OF_THREE


def test_kept_maps_serve_few_orbits_that_are_asked_for_often(
    integrations: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    # A problem that nobody has asked for before.
    own: dict[str, Any] = {"n_symbols": 6, "J1_0": "1.1e-8"}
    asked = problem(**own)
    monkeypatch.setattr(choice, "OFTEN", 2.9 * costs.integration(asked) * len(PHASES))
    kept = found(**own, method="map")
    calls = []
    for _ in range(6):
        integrations.clear()
        record = found(**own)
        calls.append((record, sum(x["orbits"] for x in integrations)))
    assert [bool(record.by_map.any()) for record, _ in calls] == [False, False, *[True] * 4]
    left = int((~kept.by_map).sum())
    # A sample is taken at once, and again after as many orbits.
    for sampled, (_, each) in zip((True, False, False, True), calls[2:], strict=True):
        assert left <= each <= 3 * (choice.LEAST_SAMPLE + left)
        assert (each > 3 * left) == sampled
    assert all((record.codes == kept.codes).all() for record, _ in calls)
    # What is stored hangs on no cache, and without maps there is nothing to take.
    assert not codes.codes_of(asked, PHASES, resolve(None, None, (53, 106))).by_map.any()
    monkeypatch.setattr(mapped, "is_kept", lambda *_: False)
    monkeypatch.setattr(costs, "budget", lambda *_: math.inf)
    assert not found(**own).by_map.any()


def test_kept_maps_wait_the_longer_the_less_the_precisions_cost(monkeypatch: Any) -> None:
    own: dict[str, Any] = {"n_symbols": 45, "J1_0": "1.3e-8"}
    asked = problem(**own)
    monkeypatch.setattr(choice, "OFTEN", 1.9 * costs.integration(asked, (53,)) * len(PHASES))
    found(**own, precisions=(53,), method="map")
    calls = [found(**own, precisions=(53,)).by_map.any() for _ in range(2)]
    assert calls == [False, True]
    # Maps begin with doubles: they serve none of whom others are asked for first.
    assert not found(PHASES[:1], **own, precisions=(64,)).by_map.any()


@pytest.mark.parametrize(
    ("J1_0", "share", "without", "calls_paid_for"),
    [
        ("1.7e-8", 2.001, 2, [3]),
        ("1.8e-8", 1.999, 1, [2]),
        # Calls of many orbits pay for themselves, so that what is made for one serves the next.
        ("1.9e-8", 0.999, 0, [1, 1, 1, 1]),
    ],
)
def test_maps_are_made_once_they_pay_for_the_orbits_of_all_calls(
    samples: Any, monkeypatch: Any, J1_0: str, share: float, without: int, calls_paid_for: Any
) -> None:
    """The first of the calls that take them is sampled, in doubles and in more bits."""
    own: dict[str, Any] = {"n_symbols": 7, "J1_0": J1_0}
    asked, n, paying, made = problem(**own), len(PHASES), list[int](), list[Any]()

    def budget(_: Any, orbits: int, *further: Any) -> float:
        paying.append(orbits)
        return math.inf

    def noted(*given: Any, **more: Any) -> ReturnMap:
        made.append((more["bits"], more["design"]))
        return return_map(*given, **more)

    monkeypatch.setattr(costs, "budget", budget)
    monkeypatch.setattr(mapped, "return_map", noted)
    monkeypatch.setattr(mapped, "is_kept", lambda *given: given[3:] in made)
    monkeypatch.setattr(costs, "LEAST_SECONDS", share * n * costs.integration(asked))
    calls = [found(**own).by_map.any() for _ in range(4)]
    assert calls == [k >= without for k in range(4)]
    assert len(samples) == 2
    # Few orbits take what is kept from then on, and ask for no others.
    assert paying == [n * calls for calls in calls_paid_for]
    # What is stored hangs on no earlier call.
    assert codes.codes_of(asked, PHASES, resolve()).by_map.any() == (not without)


@pytest.mark.usefixtures("eager")
def test_many_are_sampled_first_then_seldom(samples: list[Any], monkeypatch: Any) -> None:
    monkeypatch.setattr(choice, "SELDOM", 2 * len(PHASES))
    own: dict[str, Any] = {"n_symbols": 2, "J1_0": "1.2e-8"}
    for sampled in (True, False, True, False):
        samples.clear()
        assert found(**own).by_map.any()
        assert bool(samples) == sampled
    # With many other problems the count begins anew.
    monkeypatch.setattr(choice, "PROBLEMS", 0)
    for _ in range(2):
        samples.clear()
        found(**own)
        assert samples
    # What is asked for by name, or stored, is compared each time.
    samples.clear()
    found(**own, method="map")
    assert len(samples) == 2
    codes.codes_of(problem(**own), PHASES, resolve())
    assert len(samples) == 4


def test_maps_are_taken_where_they_pay_for_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not found(PHASES[:3], n_symbols=2).by_map.any()
    monkeypatch.setattr(costs, "LEAST_SECONDS", 0.0)
    assert not found(PHASES[:3], n_symbols=2).by_map.any(), "tables would not pay"
    monkeypatch.setattr(costs, "budget", lambda *_: math.inf)
    assert found(PHASES[:3], n_symbols=2).by_map.all()
    monkeypatch.undo()
    whole = costs.LEAST_SECONDS / costs.integration(PROBLEM)
    for of, pays in ((0.99 * whole, False), (10 * whole, True)):
        arithmetic = resolve(None, None, (53,))
        part = codes.codes_of(PROBLEM, PHASES[:3], arithmetic, task_orbits=int(of))
        assert part.by_map.all() == pays, "a part is decided as all would be"


def test_what_maps_leave_open_is_integrated_and_told_where_that_takes_long(
    monkeypatch: pytest.MonkeyPatch, integrations: list[Any]
) -> None:
    """By maps in doubles, for those of more bits do not settle."""

    def in_doubles_only(*args: Any, **more: Any) -> ReturnMap:
        if more["bits"] > 53:
            raise MapError("the tables do not settle")
        return return_map(*args, **more)

    monkeypatch.setattr(mapped, "return_map", in_doubles_only)
    monkeypatch.setattr(costs, "SLOW", 0.0)
    monkeypatch.setattr(costs, "LONG", 0.0)
    given: dict[str, Any] = {"J1_0": "1e-6", "n_symbols": 24, "precisions": (53, 106)}
    phases, handed, exactly = np.linspace(0, 6.2, 40), [], at_crossings

    def counted(*given: Any, **how: Any) -> Any:
        if given[3] == 64:
            handed.append(len(given[2]))
        return exactly(*given, **how)

    monkeypatch.setattr(handover, "at_crossings", counted)
    said = r"of 40 orbits are integrated numerically, .* more than the 53 bits of the maps"
    with pytest.warns(costs.SlowRoutesWarning, match=said):
        record = found(phases, method="map", **given)
    risen = record.bits > 53
    # By rungs, where each is computed once; all that were open come to the first of them.
    assert len(set(record.bits[risen].tolist())) > 1
    whole = sum(x["orbits"] for x in integrations if x["bits"] == 64)
    # One that is handed over may be another than the known one at its crossing: it is integrated.
    assert risen.sum() <= whole + sum(handed) <= risen.sum() + 1
    assert min(handed) > whole
    assert not record.by_map[risen].any()
    assert record.certain.all()
    assert (record.codes == found(phases, method="integration", **given).codes).all()
    # Parts of a plane warn of nothing: each would say it again.
    part = problem(n_symbols=24, J1_0="1e-6"), phases, resolve(None, None, (53, 106)), 1, "map"
    codes.codes_of(*part, task_orbits=len(phases) + 1)


@pytest.mark.usefixtures("samples")
def test_what_maps_do_not_follow_or_serve_is_integrated_and_said_to_be(
    integrations: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    followed = mapped.Maps.crossings

    def but_two(self: mapped.Maps, bits: int, scales: Scales, columns: Any) -> Crossings:
        seen = followed(self, bits, scales, columns)
        seen.outcome[columns == 3] = Outcome.NO_CROSSING
        seen.time[:, columns == 3] = math.nan
        # So that a third computation must decide, of which there is no map.
        seen.time[:, columns == 5] += 1e-4 * (scales == certainty.SECOND_SCALES)
        return seen

    monkeypatch.setattr(mapped.Maps, "crossings", but_two)
    record = found(PHASES[:7], n_symbols=3, method="map", precisions=(53,))
    assert record.certain.all()
    assert record.by_map.tolist() == [True, True, True, False, True, False, True]
    assert [x["orbits"] for x in integrations] == [1, 1, 1]


@pytest.mark.parametrize("bits", [53, 64])
def test_of_some_columns_those_are_integrated_that_maps_do_not_follow(bits: int) -> None:
    """Here the second of two, which is column 7; in the maps' own bits none."""
    outcome = np.array([Outcome.COMPLETE, Outcome.FAILED], dtype=np.uint8)
    maps, integrated = Mock(), Mock(side_effect=whole)
    maps.run.phases = range(9)
    maps.crossings.side_effect = lambda *given: whole(*given)._replace(outcome=outcome.copy())
    compute, left = choice.with_maps(maps, integrated, (53, 106))
    seen = compute(bits, Scales(), np.array([4, 7]))
    asked = [column for given in integrated.call_args_list for column in given.args[2]]
    assert np.flatnonzero(left).tolist() == asked == ([7] if bits == 53 else [])
    assert (seen.outcome == Outcome.COMPLETE).tolist() == [True, bits == 53]


@pytest.mark.parametrize("regular", [False, True])
def test_what_maps_leave_open_climbs_beyond_them(monkeypatch: Any, regular: bool) -> None:
    """An orbit that stays counts no more, and regular motions are not handed over to maps."""
    known = known_of(whole(53, Scales(), range(2)), np.zeros((3, 2), dtype=bool))
    monkeypatch.setattr(certainty, "decide", decided := Mock(return_value=known))
    monkeypatch.setattr(certainty, "climb", climb := Mock())
    monkeypatch.setattr(handover, "handed_over", handed := Mock())
    monkeypatch.setattr(costs, "warned", warned := Mock())
    monkeypatch.setattr(costs, "NONE_OPEN", 2.0 * regular)
    known.crossings.outcome[1], precisions = Outcome.STAYS, (53, 106, 400)
    run = Run(PROBLEM, Phases([1, 2]), resolve(None, None, precisions))
    maps = Mock(run=run, most_bits=53, beyond=rungs(precisions[1:], 53))
    choice.by_maps(maps, sampled=False)
    climbing = run.crossings if regular else handed.return_value
    assert climb.call_args.args == (climbing, known, run.rate, maps.beyond)
    # Where no more bits are asked for nothing climbs, and nobody is warned that it takes long.
    choice.by_maps(Mock(run=run, most_bits=53, beyond=[]), sampled=False)
    assert [climb.call_count, warned.call_count] == [1, 1]
    # The memory that maps take is bounded.
    *_, division = decided.call_args.args
    assert division(2, 53) == (choice.PIECE // (PROBLEM.n_symbols + 1), 1)
    _, each = costs.beyond_maps(PROBLEM, precisions)
    assert warned.call_args.args[:4] == (PROBLEM, 1, 2, each)


@pytest.mark.usefixtures("samples")
@pytest.mark.parametrize(("off", "bits"), [(0.0, [109, 120]), (1.0, [109, 120, 120])])
def test_what_leaves_sharper_tables_waits_for_a_precision_that_was_asked_for(
    off: float, bits: list[int], integrations: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """And is computed again in the last one, where this differs from a rung by as much as `off`."""
    followed, integrated = mapped.Maps.crossings, Run.crossings

    def but_one(self: mapped.Maps, bits: int, scales: Scales, columns: Any) -> Crossings:
        seen, one = followed(self, bits, scales, columns), columns == 3
        if bits > 53:
            seen.outcome[one], seen.time[:, one] = Outcome.NO_CROSSING, math.nan
        seen.time[:, one] += 1.0 * (scales == certainty.SECOND_SCALES)
        return seen

    def late(self: Run, bits: int, scales: Scales, columns: Any) -> Crossings:
        seen = integrated(self, bits, scales, columns)
        return seen._replace(time=seen.time + off * (bits == 109))

    monkeypatch.setattr(mapped.Maps, "crossings", but_one)
    monkeypatch.setattr(Run, "crossings", late)
    record = found(PHASES[:7], n_symbols=3, method="map", precisions=(53, 120))
    assert record.certain.all()
    assert [(x["bits"], x["orbits"]) for x in integrations] == [(each, 1) for each in bits]


def test_orbits_without_a_map_are_integrated_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    heavy = Body((2, 1, "1.5"), (1, 1, 0), "0.5")
    symmetric = Body(("2.673", "2.520", "2.527"), (1, 1, 0), "0.004")
    some = PHASES[:2]
    with pytest.raises(MapError):
        found(some, heavy, n_symbols=2, method="map")
    with pytest.raises(MapError, match="outside of the normal form"):
        found(some, n_symbols=2, J1_0="0.7073", method="map")
    monkeypatch.setattr(costs, "LEAST_SECONDS", 0.0)
    assert not found(some, heavy, n_symbols=2).by_map.any()
    monkeypatch.setattr(costs, "LONG", 0.0)
    # Such starts are as far from the surfaces as these are displaced, and in no thinner layer.
    far = {"h0": 1, "J1_0": "0.001", "n_symbols": 1}
    each = costs.integration(problem(symmetric, **far), (53,))
    told = f"{seconds(each)} each .* no return maps: the body is nearly symmetric"
    with pytest.warns(costs.SlowRoutesWarning, match=told):
        found(some[:1], symmetric, **far, precisions=(53,))


@pytest.mark.parametrize(("engine", "told"), [("taylor", 1), ("scipy", 0)])
def test_that_no_orbit_is_followed_to_a_symbol_is_told_of_the_engine_that_gives_up(
    engine: str, told: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Run, "by_integration", Mock())
    symmetric = problem(Body(("1", "1 - 1e-11", "1 - 1e-12"), (1, 1, 0), "1e-6"))
    with warnings.catch_warnings(record=True, action="always") as said:
        choice.decide(Run(symmetric, Phases([1.0]), resolve(engine, None, (53,))))
    assert len(said) == told


@pytest.mark.usefixtures("eager")
@pytest.mark.parametrize("above", ["1e-8", "0.7072"])
def test_orbits_that_start_beside_the_upper_periodic_orbit_have_no_map(above: str) -> None:
    J1_0 = f"sqrt(2*1.3342*3/4) - {above}"
    with pytest.raises(MapError, match="is above J2_0/2"):
        found(PHASES[:2], J1_0=J1_0, n_symbols=2, method="map")
    problem = replace(PROBLEM, J1_0=exact(J1_0))
    with pytest.raises(MapError, match="is above J2_0/2"):
        orbits_of(problem)
    assert mapped.expected_tables(problem, 1000, math.inf) == math.inf
    assert not found(PHASES, J1_0=J1_0, n_symbols=2).by_map.any()


@pytest.mark.usefixtures("eager")
def test_a_sample_of_few_is_in_more_bits_and_the_rest_in_doubles(samples: list[Any]) -> None:
    """Of a small part of all orbits one sample is enough."""
    shares, few = choice.SAMPLE // choice.LEAST_SAMPLE, (choice.LEAST_SAMPLE, (53, 106))
    for parts, expected in (
        (1, [few, (choice.SAMPLE - choice.LEAST_SAMPLE, (53,))]),
        (shares - 1, [few, (choice.ABREAST, (53,))]),
        (shares, [few]),
    ):
        samples.clear()
        arithmetic = resolve(None, None, (53, 106))
        codes.codes_of(PROBLEM, PHASES[:100], arithmetic, 1, "map", task_orbits=100 * parts)
        assert samples == expected


def known_of(seen: Crossings, certain: Any, bits: int = 53) -> certainty.Decided:
    """What is known of orbits that all have so many bits."""
    every = np.full(len(seen.outcome), bits, dtype=np.uint16)
    return certainty.Decided(seen, certain, every, every < 0)


def whole(_: int, __: Scales, columns: Any) -> Crossings:
    """Crossings of orbits that are all alike."""
    n = len(columns)
    return Crossings(
        np.ones((3, n)), np.full((3, n), 2, dtype=np.uint8), np.full(n, Outcome.COMPLETE)
    )


@pytest.mark.parametrize(
    ("n", "size", "sample"),
    [
        (1, 5, [0]),
        *((11, size, [0, 1, 2, 3, 7, 8, 9, 10]) for size in (5, 8)),
        (21, 12, [0, 1, 2, 3, 8, 9, 10, 11, 17, 18, 19, 20]),
        *((n, size, list(range(n))) for n, size in ((4, 9), (6, 6))),
    ],
)
def test_what_is_certain_of_a_sample_is_contradicted(n: int, size: int, sample: list[int]) -> None:
    chosen = choice.sample_of(n, size)
    assert chosen.tolist() == sample
    seen = whole(53, Scales(), range(n))
    # The second of two symbols is another one.
    seen.separatrix[2] = 1
    for sure, wrong in ((True, sample), (False, [])):
        known = known_of(seen, np.full((2, n), sure))
        found, telling = choice.contradicted(known, whole, 1.0, (53,), chosen)
        assert found.tolist() == wrong
        assert telling != sure


@pytest.mark.parametrize(("lost", "telling"), [(0, True), (4, True), (5, False), (8, False)])
def test_doubles_that_lose_most_orbits_of_a_sample_tell_little(lost: int, telling: bool) -> None:
    """More bits tell whether the lost ones contradict."""

    def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
        found = whole(bits, scales, columns)
        if bits == 53:
            found.separatrix[2, columns < lost] = 1
            found.time[2, columns < lost] += float(scales.momentum)
        return found

    seen, sample = whole(53, Scales(), range(8)), np.arange(8)
    known = known_of(seen, np.full((2, 8), True), 82)
    for precisions in ((53,), (53, 106)):
        wrong, told = choice.contradicted(known, compute, 1.0, precisions, sample)
        assert not wrong.size
        assert told == telling
    seen.separatrix[2, 3:5] = 3
    for precisions, found in (((53,), {3, 4} - set(range(lost))), ((53, 106), {3, 4})):
        wrong, told = choice.contradicted(known, compute, 1.0, precisions, sample)
        assert set(wrong) == found
        assert told == (lost == 0), "more bits do not make doubles tell"


def test_a_sample_is_integrated_once_and_again_only_where_that_differs() -> None:
    """A symbol that is not certain may differ."""
    made: list[tuple[int, int]] = []

    def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
        made.append((bits, len(columns)))
        return whole(bits, scales, columns)

    seen, every = whole(53, Scales(), range(8)), np.full((2, 8), True)
    seen.separatrix[2, :3] = 1
    every[1, 0] = False
    known = known_of(seen, every)
    found, _ = choice.contradicted(known, compute, 1.0, (53, 106), np.arange(3, 8))
    assert (found.tolist(), made) == ([], [(53, 5)])
    found, _ = choice.contradicted(known, compute, 1.0, (53, 106), np.arange(8))
    assert (found.tolist(), made[1:]) == ([1, 2], [(53, 8), (106, 2), (53, 2), (53, 2)])


@pytest.mark.usefixtures("eager")
@pytest.mark.parametrize(("telling", "sampled"), [(True, choice.SAMPLE), (False, 8)])
def test_where_doubles_tell_little_the_small_sample_is_all(
    monkeypatch: pytest.MonkeyPatch, telling: bool, sampled: int
) -> None:
    compared = Mock(return_value=(np.array([], dtype=int), telling))
    monkeypatch.setattr(choice, "contradicted", compared)
    codes.codes_of(PROBLEM, PHASES[:100], resolve(None, None, (53, 106)), 1, "map")
    seen = np.concatenate([given.args[-1] for given in compared.call_args_list])
    assert sorted(seen) == choice.sample_of(100, sampled).tolist()


FEW = np.linspace(0.5, 6, 10)
CELLS: Any = {"arithmetic": resolve(None, None, (53,)), "ends": (1e-9, 1e-8)}


@pytest.mark.usefixtures("eager")
@pytest.mark.parametrize(
    ("call", "said"),
    [
        # A problem that nobody has asked for before, of which a sample is taken.
        (lambda: found(FEW, n_symbols=3, J1_0="1.3e-8", jobs=2), r"= 0\.5 and J1_0 = 1\.3e-8"),
        (lambda: found(FEW, n_symbols=3, method="map", jobs=2), "8 of the orbits in a sample diff"),
        (lambda: cells_of_starts(PROBLEM, FEW, np.full(10, 1e-9), **CELLS), "5 and J1_0 = 1e-09"),
    ],
)
def test_what_contradicts_is_not_given(
    call: Callable[[], Any], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All maps find the mirror image of every orbit: they err alike, so that they agree."""
    real = mapped.Maps.crossings

    def alike(self: mapped.Maps, bits: int, scales: Scales, columns: Any) -> Any:
        right = real(self, bits, scales, columns)
        image = np.array([0, 1, 4, 3, 2], dtype=np.uint8)[right.separatrix]
        return right._replace(separatrix=image)

    monkeypatch.setattr(mapped.Maps, "crossings", alike)
    for _ in ("at first", "when it is asked for again"):
        with pytest.raises(Contradiction, match=said) as told:
            call()
        # Nobody who catches what a computation may refuse takes it for that.
        assert not isinstance(told.value, ArithmeticError | ValueError | RuntimeError | LookupError)
