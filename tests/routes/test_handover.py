"""Orbits that maps leave open, handed over from an integration to a map."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.free_body import symbols
from rigidpend.orbits import columns as columns_of
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.states import at_crossings
from rigidpend.orbits.return_map import ReturnMap
from rigidpend.orbits.return_map.build import FIRST, SECOND, Design
from rigidpend.orbits.return_map.program import Program
from rigidpend.routes import certainty, choice, costs, handover
from rigidpend.routes.certainty import Decided
from rigidpend.routes.handover import GROWING, LATEST, TIME_ERROR_BITS, handed_over
from rigidpend.routes.ladder import kept_bits, rungs
from rigidpend.routes.mapped import Maps
from rigidpend.routes.phases import Phases
from rigidpend.routes.run import Run
from tests.bodies import problem

PROBLEM = problem(n_symbols=40)
PHASES = np.linspace(0.01, 6.27, 60)


def run(precisions: tuple[int, ...] = (53, 106, 160)) -> Run:
    return Run(PROBLEM, Phases(PHASES), resolve(precisions=precisions))


@pytest.fixture(scope="module")
def maps() -> Maps:
    """Of 64 and 75 bits, which leave some of the orbits open."""
    return Maps(run())


@pytest.fixture(scope="module")
def known(maps: Maps) -> Decided:
    compute, _ = choice.with_maps(maps, maps.run.crossings, ())
    return certainty.decide(compute, len(PHASES), maps.run.rate, maps.ladder)


@pytest.fixture(scope="module")
def open_(known: Decided) -> Any:
    found = np.flatnonzero(~known.certain.all(axis=0))
    assert found.size > 8
    return found


@pytest.fixture(scope="module")
def exact(maps: Maps) -> Crossings:
    """What more bits find without a map."""
    return maps.run.crossings(160, certainty.THIRD_SCALES, np.arange(len(PHASES)))


@pytest.fixture(scope="module")
def whole(exact: Crossings, open_: Any) -> Crossings:
    """That of the orbits that maps leave open."""
    return columns_of(exact, open_)


LADDER = rungs((88, 106, 109, 120, 160, 500))


def taken_over(maps: Maps, bits: int, columns: Any, known: Decided) -> Any:
    # Of 88 bits the first map takes over, and of 106 the second, which found what is known.
    more = kept_bits(bits) - maps.built_bits[FIRST if bits == 88 else SECOND]
    return handover.handover(maps, more, columns, known)


def copied(known: Decided) -> Decided:
    return columns_of(known, np.arange(len(PHASES)))


def nobody(*_: Any) -> Crossings:
    raise AssertionError("an orbit is integrated to its end")


@pytest.mark.parametrize("bits", [88, 106])
def test_an_orbit_that_is_handed_over_errs_as_one_of_these_bits_that_is_integrated(
    maps: Maps, known: Decided, open_: Any, whole: Crossings, bits: int
) -> None:
    at = taken_over(maps, bits, open_, known)
    some = at > 0
    assert some.sum() >= 2
    found = handed_over(maps, nobody, known, LADDER)(bits, certainty.FIRST_SCALES, open_[some])
    by_integration = maps.run.crossings(bits, certainty.FIRST_SCALES, open_[some])
    own = by_integration.time - columns_of(whole, some).time
    assert (found.outcome == Outcome.COMPLETE).all()
    assert (found.separatrix == by_integration.separatrix).all()
    # A map's errors are seen to be 2^-13 of it at most in the mean: that of one orbit may be more,
    # but no part of it that counts. Doubles store times of 500.
    behind = np.arange(len(own))[:, None] >= at[some]
    gap = np.abs(found.time - by_integration.time)[behind]
    assert (gap <= 0.02 * np.abs(own)[behind] + 1e-12).all()
    # What is known before errs by ten times as much and more.
    before = columns_of(known.crossings, open_[some]).time - columns_of(whole, some).time
    assert np.median(np.abs(before[-1] / own[-1])) > 10


@pytest.mark.parametrize(
    ("pair", "turns"), [((64, 75), [FIRST, SECOND]), ((64, 53), [SECOND, FIRST])]
)
def test_orbits_are_handed_over_to_the_map_that_did_not_find_what_is_known(
    known: Decided,
    open_: Any,
    pair: tuple[int, int],
    turns: list[Design],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where only the first map has more than 53 bits, it found that, and comes second."""
    monkeypatch.setattr(costs, "wanted", lambda _: (pair, (53, 53)))
    maps, used = Maps(run()), list[Design]()
    assert maps.map_bits == pair

    def onward(design: Design, columns: Any, *_: Any, **more: Any) -> Any:
        used.append(design)
        raise ArithmeticError

    monkeypatch.setattr(maps, "onward", onward)
    computing = handed_over(maps, nobody, known, LADDER)
    for bits in (88, 106):
        with pytest.raises(ArithmeticError):
            computing(bits, certainty.FIRST_SCALES, open_)
    assert used == turns


def test_deep_passages_are_handed_over_to_whole_tables_as_sharp_as_the_second_map(
    known: Decided, open_: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first map's own computation, of 82 bits, leaves terms out."""
    monkeypatch.setattr(costs, "passage_rotations", lambda _: costs.DEEP)
    maps, more, used, program = Maps(run()), list[int](), set[Any](), ReturnMap.program

    def watched(made: ReturnMap, bits: int, *given: Any) -> Program:
        used.add((made.design, made.bits, bits, given[-1] > 0))
        return program(made, bits, *given)

    def nowhere(_: Maps, by: int, columns: Any, __: Any) -> Any:
        more.append(by)
        return 0 * columns

    monkeypatch.setattr(ReturnMap, "program", watched)
    monkeypatch.setattr(handover, "handover", nowhere)
    one = columns_of(known.crossings, open_[:1])
    for fewer in (0, 3):
        monkeypatch.setattr(handover, "narrower", lambda _, fewer=fewer: fewer)
        for bits in (106, 109):
            computed = handed_over(maps, lambda *_: one, known, LADDER)
            computed(bits, certainty.FIRST_SCALES, open_[:1])
    # Of pairs of doubles 97 bits count. A map of a layer narrower by 3 bits is as much sharper, and
    # its errors in doubles begin as much below `GROWING`.
    assert more == [97 - 90, 109 - 90, 97 - 90 - 6, 109 - 90 - 6]
    maps.crossings(82, certainty.FIRST_SCALES, open_)
    beside_2 = np.array([[1, 1e-4, 0, 0.6, 0.8, 0]]).T
    maps.onward(FIRST, open_[:1], beside_2, np.zeros(1), 3, rising=True)
    assert used == {(FIRST, 90, 82, True), (FIRST, 90, 90, False)}


def told(error: Any, certain: Any) -> tuple[Any, Decided]:
    """Maps whose doubles differ by so much from what is known, and what is known."""
    crossings = Crossings(
        np.zeros_like(error), np.zeros(error.shape, np.uint8), np.zeros(1, np.uint8)
    )
    doubles = crossings._replace(time=error)
    own = SimpleNamespace(rate=0.5)
    maps = SimpleNamespace(run=own, crossings=lambda *_: doubles)
    return maps, Decided(crossings, certain, np.array([75]), np.zeros(1, dtype=bool))


@pytest.mark.parametrize(
    ("at", "factor", "certain", "expected"),
    [
        (4, 1.001, 19, 4),
        (4, 0.999, 19, 5),
        (4, np.nan, 19, 4),
        # The first crossing is the beginning.
        (0, 2.0, 19, 1),
        # What is not established is nothing to go on from.
        (4, 2.0, 4, 4),
        (4, 2.0, 3, 0),
        (14, 2.0, 19, 14),
        (15, 2.0, 19, 0),
        (19, 0.5, 19, 0),
    ],
)
def test_a_map_takes_over_where_an_error_has_grown_by_what_more_bits_gain(
    at: int, factor: float, certain: int, expected: int
) -> None:
    """From 2^17 roundings on."""
    limit = 2.0**17 * 2.0**31 * 2.0**-53
    assert GROWING == 2**17
    error = np.full((20, 1), limit / 0.5 * 0.5)
    error[at], error[at + 1 :] = limit / 0.5 * factor, limit / 0.5 * 8
    established = (np.arange(19) < certain)[:, None]
    assert LATEST * 20 == 14
    maps, known = told(error, established)
    assert handover.handover(maps, 31, np.zeros(1, dtype=int), known).tolist() == [expected]


def mirrored(known: Crossings, at: Any) -> None:
    known.separatrix[at] = (known.separatrix[at] + 1) % 4 + 1


def displaced(by: float) -> Any:
    def spoil(known: Crossings, at: Any) -> None:
        known.time[at] += by

    return spoil


def before(known: Crossings, at: Any) -> None:
    """The time of the crossing before it."""
    row, column = at
    known.time[at] = known.time[row - 1, column]


RATE = run().rate


@pytest.mark.parametrize(
    ("spoil", "whole"),
    [
        (displaced(0.999 * certainty.LIMIT_OF_TWO / RATE), False),
        (displaced(1.001 * certainty.LIMIT_OF_TWO / RATE), True),
        (mirrored, True),
        (before, True),
    ],
    ids=["nearly in time", "late", "mirrored", "another crossing"],
)
def test_an_orbit_that_is_not_where_it_is_known_to_cross_is_integrated_to_its_end(
    maps: Maps, known: Decided, open_: Any, spoil: Any, whole: bool
) -> None:
    at = taken_over(maps, 88, open_, known)
    at, some = at[at > 0], open_[at > 0]
    wrong, asked = copied(known), []
    spoil(wrong.crossings, (at, some))

    def integrated(bits: int, scales: Any, columns: Any) -> Crossings:
        asked.append((bits, scales, columns.tolist()))
        return columns_of(known.crossings, columns)

    # Where they are handed over is not what is on trial.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(handover, "handover", lambda *_: at)
        handed_over(maps, integrated, wrong, LADDER)(88, certainty.FIRST_SCALES, some)
    assert asked == ([(88, certainty.FIRST_SCALES, some.tolist())] if whole else [])


@pytest.mark.parametrize(("share", "whole"), [(0.99, False), (1.01, True), (-1.01, True)])
def test_the_orbit_that_is_left_beside_the_section_is_integrated_to_its_end(
    maps: Maps,
    known: Decided,
    open_: Any,
    monkeypatch: pytest.MonkeyPatch,
    share: float,
    whole: bool,
) -> None:
    """A bit of 88 is 2^-88: a crossing may be off by 2^8 of them. Those that come first, first."""
    asked: list[int] = []

    def beside(*given: Any, **more: Any) -> Any:
        time, states, late = at_crossings(*given, **more)
        assert (np.abs(late) < 2.0 ** (8 - 88)).all()
        return time, states, np.append(share * 2.0 ** (8 - 88), late[1:])

    def integrated(_: int, __: Any, columns: Any) -> Crossings:
        asked.extend(columns)
        return columns_of(known.crossings, columns)

    assert TIME_ERROR_BITS == 8
    monkeypatch.setattr(handover, "at_crossings", beside)
    at = taken_over(maps, 88, open_, known)
    at, some = at[at > 0], open_[at > 0]
    first = some[np.argmin(known.crossings.time[at, some])]
    assert first != some[0]
    handed_over(maps, integrated, known, LADDER)(88, certainty.FIRST_SCALES, some)
    assert asked == ([first] if whole else [])


def test_an_orbit_that_leaves_the_tables_is_integrated_to_its_end(
    maps: Maps, known: Decided, open_: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    onward, asked = Maps.onward, []

    def left(self: Maps, *given: Any, **more: Any) -> Any:
        beside, further = onward(self, *given, **more)
        further.separatrix[3:] = 0
        return beside, further

    def integrated(_: int, __: Any, columns: Any) -> Crossings:
        asked.extend(columns)
        return columns_of(known.crossings, columns)

    monkeypatch.setattr(Maps, "onward", left)
    at = taken_over(maps, 88, open_, known)
    handed_over(maps, integrated, known, LADDER)(88, certainty.FIRST_SCALES, open_[at > 0])
    assert sorted(asked) == open_[at > 0].tolist()


@pytest.mark.parametrize("bits", [88, 500])
def test_what_confirms_is_integrated_and_so_is_what_the_kernel_has_no_numbers_for(
    maps: Maps, known: Decided, open_: Any, bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(handover, "handover", None)
    asked = []

    def integrated(_: int, scales: Any, columns: Any) -> Crossings:
        asked.append(scales)
        return columns_of(known.crossings, columns)

    scales = certainty.SECOND_SCALES if bits == 88 else certainty.FIRST_SCALES
    handed_over(maps, integrated, known, LADDER)(bits, scales, open_)
    assert asked == [scales]


def test_symbols_of_orbits_that_are_handed_over_are_those_of_integrations(
    maps: Maps, open_: Any, whole: Crossings
) -> None:
    """Only in the last precision is an orbit followed more than once."""
    asked, own = [], Run.crossings

    def counted(self: Run, bits: int, scales: Any, columns: Any) -> Crossings:
        asked.append((bits, scales))
        return own(self, bits, scales, columns)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Run, "crossings", counted)
        found = choice.by_maps(maps, sampled=False)
    assert found.certain.all()
    assert not found.by_map[open_].any()
    assert (symbols(found.crossings.separatrix[:, open_]) == symbols(whole.separatrix)).all()
    assert all(scales == certainty.FIRST_SCALES for bits, scales in asked if bits < 160)


@pytest.mark.parametrize("wrong", [FIRST, SECOND])
def test_a_map_that_is_wrong_on_late_passages_confirms_nothing_by_itself(
    maps: Maps, exact: Crossings, monkeypatch: pytest.MonkeyPatch, wrong: Design
) -> None:
    """It says so of all that it follows, from the start and from where it takes over."""
    late, crossings, onward = 1.0 / RATE, Maps.crossings, Maps.onward

    def from_start(self: Maps, bits: int, scales: Any, columns: Any) -> Crossings:
        found = crossings(self, bits, scales, columns)
        if wrong in self.by_bits.get(bits, ()) and bits > 53:
            found.time[-1] += late
        return found

    def from_there(self: Maps, of: Design, *given: Any, **more: Any) -> Any:
        beside, found = onward(self, of, *given, **more)
        if of == wrong:
            last = np.abs(found.time - exact.time[-1, given[0]]) < 4
            assert last.sum() == last.shape[1]
            found.time[last] += late
        return beside, found

    monkeypatch.setattr(Maps, "crossings", from_start)
    monkeypatch.setattr(Maps, "onward", from_there)
    found = choice.by_maps(maps, sampled=False)
    gap = RATE * np.abs(found.crossings.time[-1] - exact.time[-1])
    assert found.certain[-1].any()
    assert (gap[found.certain[-1]] < 2 * certainty.LIMIT_OF_UNEQUAL).all()
