"""Orbits that maps leave open, handed over from an integration to a map."""

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

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


LADDER = rungs((88, 106, 109, 120, 160, 500))


def run() -> Run:
    return Run(PROBLEM, Phases(PHASES), resolve(precisions=(53, 106, 160)))


class Orbits(NamedTuple):
    """Orbits followed by maps of 64 and 75 bits, which leave some of them open."""

    maps: Maps
    known: Decided
    open_: Any
    exact: Crossings
    """What more bits find without a map."""

    def at(self, bits: int) -> tuple[Any, Any]:
        """Crossings at which a map takes over open orbits, and these."""
        # Of 88 bits the first map takes over, and of 106 the second, which found what is known.
        more = kept_bits(bits) - self.maps.built_bits[FIRST if bits == 88 else SECOND]
        at = handover.handover(self.maps, more, self.open_, self.known)
        return at[at > 0], self.open_[at > 0]


@pytest.fixture(scope="module")
def orbits() -> Orbits:
    maps = Maps(run())
    compute, _ = choice.with_maps(maps, maps.run.crossings, ())
    known = certainty.decide(compute, len(PHASES), maps.run.rate, maps.ladder)
    open_ = np.flatnonzero(~known.certain.all(axis=0))
    assert open_.size > 8
    exact = maps.run.crossings(160, certainty.THIRD_SCALES, np.arange(len(PHASES)))
    return Orbits(maps, known, open_, exact)


class Integrated:
    """Integrations of orbits to their ends, which find what is known; what is asked of them."""

    def __init__(self, known: Decided) -> None:
        self.known, self.asked = known, list[tuple[int, Any, list[int]]]()

    def __call__(self, bits: int, scales: Any, columns: Any) -> Crossings:
        self.asked.append((bits, scales, list(columns)))
        return columns_of(self.known.crossings, columns)


@pytest.mark.parametrize("bits", [88, 106])
def test_an_orbit_that_is_handed_over_errs_as_one_of_these_bits_that_is_integrated(
    orbits: Orbits, bits: int
) -> None:
    maps, known, _, exact = orbits
    at, some = orbits.at(bits)
    assert some.size >= 2
    to_end = Integrated(known)
    found = handed_over(maps, to_end, known, LADDER)(bits, certainty.FIRST_SCALES, some)
    assert not to_end.asked
    by_integration = maps.run.crossings(bits, certainty.FIRST_SCALES, some)
    own = by_integration.time - exact.time[:, some]
    assert (found.outcome == Outcome.COMPLETE).all()
    assert (found.separatrix == by_integration.separatrix).all()
    # A map's errors are seen to be 2^-13 of it at most in the mean: that of one orbit may be more,
    # but no part of it that counts. Doubles store times of 500.
    behind = np.arange(len(own))[:, None] >= at
    gap = np.abs(found.time - by_integration.time)[behind]
    assert (gap <= 0.02 * np.abs(own)[behind] + 1e-12).all()
    # What is known before errs by ten times as much and more.
    before = (known.crossings.time - exact.time)[:, some]
    assert np.median(np.abs(before[-1] / own[-1])) > 10


@pytest.mark.parametrize(
    ("pair", "turns"), [((64, 75), [FIRST, SECOND]), ((64, 53), [SECOND, FIRST])]
)
def test_orbits_are_handed_over_to_the_map_that_did_not_find_what_is_known(
    orbits: Orbits, pair: tuple[int, int], turns: list[Design], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where only the first map has more than 53 bits, it found that, and comes second."""
    monkeypatch.setattr(costs, "wanted", lambda _: (pair, (53, 53)))
    maps, used = Maps(run()), list[Design]()
    assert maps.map_bits == pair

    def onward(design: Design, columns: Any, *_: Any, **more: Any) -> Any:
        used.append(design)
        raise ArithmeticError

    monkeypatch.setattr(maps, "onward", onward)
    computing = handed_over(maps, Integrated(orbits.known), orbits.known, LADDER)
    for bits in (88, 106):
        with pytest.raises(ArithmeticError):
            computing(bits, certainty.FIRST_SCALES, orbits.open_)
    assert used == turns


def test_deep_passages_are_handed_over_to_whole_tables_as_sharp_as_the_second_map(
    orbits: Orbits, monkeypatch: pytest.MonkeyPatch
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
    _, known, open_, _ = orbits
    for fewer in (0, 3):
        monkeypatch.setattr(handover, "narrower", lambda _, fewer=fewer: fewer)
        for bits in (106, 109):
            computed = handed_over(maps, Integrated(known), known, LADDER)
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
    orbits: Orbits, spoil: Any, whole: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    known, (at, some) = orbits.known, orbits.at(88)
    wrong, to_end = columns_of(known, np.arange(len(PHASES))), Integrated(known)
    spoil(wrong.crossings, (at, some))
    # Where they are handed over is not what is on trial.
    monkeypatch.setattr(handover, "handover", lambda *_: at)
    handed_over(orbits.maps, to_end, wrong, LADDER)(88, certainty.FIRST_SCALES, some)
    assert to_end.asked == ([(88, certainty.FIRST_SCALES, some.tolist())] if whole else [])


@pytest.mark.parametrize(("share", "whole"), [(0.99, False), (1.01, True), (-1.01, True)])
def test_the_orbit_that_is_left_beside_the_section_is_integrated_to_its_end(
    orbits: Orbits, share: float, whole: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bit of 88 is 2^-88: a crossing may be off by 2^8 of them. Those that come first, first."""
    known, (at, some), to_end = orbits.known, orbits.at(88), Integrated(orbits.known)

    def beside(*given: Any, **more: Any) -> Any:
        time, states, late = at_crossings(*given, **more)
        assert (np.abs(late) < 2.0 ** (8 - 88)).all()
        return time, states, np.append(share * 2.0 ** (8 - 88), late[1:])

    assert TIME_ERROR_BITS == 8
    monkeypatch.setattr(handover, "at_crossings", beside)
    first = some[np.argmin(known.crossings.time[at, some])]
    assert first != some[0]
    handed_over(orbits.maps, to_end, known, LADDER)(88, certainty.FIRST_SCALES, some)
    assert [columns for _, _, columns in to_end.asked] == ([[first]] if whole else [])


def test_an_orbit_that_leaves_the_tables_is_integrated_to_its_end(
    orbits: Orbits, monkeypatch: pytest.MonkeyPatch
) -> None:
    onward, (_, some), to_end = Maps.onward, orbits.at(88), Integrated(orbits.known)

    def left(self: Maps, *given: Any, **more: Any) -> Any:
        beside, further = onward(self, *given, **more)
        further.separatrix[3:] = 0
        return beside, further

    monkeypatch.setattr(Maps, "onward", left)
    handed_over(orbits.maps, to_end, orbits.known, LADDER)(88, certainty.FIRST_SCALES, some)
    assert sorted(k for _, _, columns in to_end.asked for k in columns) == some.tolist()


@pytest.mark.parametrize(
    ("bits", "scales"), [(88, certainty.SECOND_SCALES), (500, certainty.FIRST_SCALES)]
)
def test_what_confirms_is_integrated_and_so_is_what_the_kernel_has_no_numbers_for(
    orbits: Orbits, bits: int, scales: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(handover, "handover", None)
    to_end = Integrated(orbits.known)
    handed_over(orbits.maps, to_end, orbits.known, LADDER)(bits, scales, orbits.open_)
    assert to_end.asked == [(bits, scales, orbits.open_.tolist())]


@pytest.mark.parametrize("wrong", [FIRST, SECOND])
def test_a_map_that_is_wrong_on_late_passages_confirms_nothing_by_itself(
    orbits: Orbits, monkeypatch: pytest.MonkeyPatch, wrong: Design
) -> None:
    """It says so of all that it follows, from the start and from where it takes over."""
    late, exact, crossings, onward = 1.0 / RATE, orbits.exact, Maps.crossings, Maps.onward

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
    found = choice.by_maps(orbits.maps, sampled=False)
    assert not found.by_map[orbits.open_].any()
    gap = RATE * np.abs(found.crossings.time[-1] - exact.time[-1])
    assert found.certain[-1].any()
    assert (gap[found.certain[-1]] < 2 * certainty.LIMIT_OF_UNEQUAL).all()
