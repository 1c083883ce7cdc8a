"""Orbits in doubt: integrated for a part of their way, by maps for the rest."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend import RouteCodes, route_codes
from rigidpend.integrate import batch, batch_sections
from rigidpend.integrate.arithmetic import Arithmetic, resolve
from rigidpend.integrate.batch_sections import Reached
from rigidpend.measure.stress.spoilt_maps import SpoiltMaps
from rigidpend.numbers.exact import exact
from rigidpend.return_map.precision import native
from rigidpend.routes import certainty, handover, mapped, plane
from rigidpend.routes.certainty import Decided
from rigidpend.routes.codes import Run, tolerance_of
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, phase_rate
from rigidpend.routes.start import Scales
from tests.integrate.problems import FIG4

DOCS = Path(__file__).parents[2] / "docs"
N = 30
PROBLEM = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), N)
RATE = phase_rate(PROBLEM)
PHASES = Phases(np.random.default_rng(21).uniform(0, 6.28, 24))
RUN = Run(PROBLEM, PHASES, resolve("taylor", None, (53, 106)), 1)
ALL = np.arange(len(PHASES))
pytestmark = [
    pytest.mark.skipif(native(64) is None, reason="there are no tables of 64 bits"),
]


def codes(phases: Any, method: str, *bits: int) -> RouteCodes:
    """The first 15 symbols."""
    given: dict[str, Any] = {"h0": PROBLEM.h0, "J1_0": PROBLEM.J1_0, "n_symbols": 15}
    return route_codes(FIG4, phases, **given, method=method, precisions=bits)


def growth(phases: Any, method: str, n: int) -> float:
    """By how much one of n passages multiplies the error of crossing times, in the median."""
    exact_times = codes(phases, "integration", 106).crossing_time
    error = np.abs(codes(phases, method, 53).crossing_time - exact_times)
    # Before the fifth crossing it is what the times themselves are rounded by.
    return float((np.median(error[4 + n]) / np.median(error[4])) ** (1 / n))


@pytest.mark.slow
def test_errors_grow_as_the_documentation_says() -> None:
    told = re.search(r"error by ([\d.]+) in the median", (DOCS / "certainty.md").read_text())
    assert told
    assert f"multiplies the error of a map by {told[1]} in" in " ".join(
        str(handover.__doc__).split()
    )
    phases = np.random.default_rng(11).uniform(0, 2 * np.pi, 40_000).tolist()
    # A hundred phases tell it to 4 %.
    assert growth(phases[:100], "integration", 11) == pytest.approx(float(told[1]), rel=0.1)
    certain = codes(phases, "map", 53, 64).certain.all(axis=0)
    left = [phases[k] for k in np.flatnonzero(~certain)]
    assert 20 < len(left) < 80
    assert 7 < growth(left[:30], "map", 6) < 14


class Integrated:
    """The integration, with every state that it reaches off by a relative size."""

    in_pairs = True

    def __init__(self, size: float = 0.0) -> None:
        self.size = size
        self.crossed: list[Any] = []

    def crossings(self, bits: int, scales: Scales, columns: Any) -> Any:
        self.crossed.append(columns)
        return RUN.crossings(bits, scales, columns)

    def reached(self, scales: Scales, columns: Any, wanted: Any) -> Any:
        found = RUN.reached(scales, columns, wanted)
        random = np.random.default_rng(int(100 * float(scales.momentum)))
        return found._replace(state=found.state * (1 + self.size * random.normal(size=(6, 1))))


def decided(maps: mapped.Maps, integrated: Any) -> Decided:
    """All columns, as if maps had left them open."""
    before = maps.crossings(64, certainty.SECOND, ALL)
    unknown = np.zeros((N, ALL.size), dtype=bool)
    known = Decided(before, unknown, np.full(ALL.size, 64, dtype=np.uint16))
    handover.decide(maps, integrated, known, ALL, RATE)
    return known


@pytest.fixture(scope="module")
def maps() -> mapped.Maps:
    made = mapped.Maps(PROBLEM, PHASES)
    made.orbits = mapped.THIRDS
    return made


@pytest.fixture(scope="module")
def truth() -> Any:
    """The crossings by integration all the way."""
    return RUN.crossings(106, certainty.SECOND, ALL)


def test_agrees_with_integration_all_the_way_far_better_than_the_maps_do(
    maps: mapped.Maps, truth: Any
) -> None:
    alone = [maps.crossings(64, s, ALL).time[-1] for s in (certainty.FIRST, certainty.SECOND)]
    integrated = Integrated()
    found = decided(maps, integrated)
    assert found.certain.all()
    assert not integrated.crossed, "none all the way"
    assert np.array_equal(found.crossings.separatrix, truth.separatrix)
    assert set(found.bits) == {106}
    late = np.abs(found.crossings.time[-1] - truth.time[-1])
    # One of two maps may be right by chance.
    before = np.abs(np.array(alone) - truth.time[-1]).max(axis=0)
    # Two thousandfold is what the rule for computations of different precision asks for; errors
    # of more than a radian grow no more, and times are doubles of some 500.
    linear = before < certainty.LINEAR
    assert np.quantile(before, 0.8) > 1e-5, "nothing is in doubt"
    assert (late < 1e-12 + before / 2000)[linear].all()
    assert np.median(late[before > 1e-9] / before[before > 1e-9]) < 1e-6


def test_orbits_are_handed_over_where_the_maps_begin_to_differ(maps: mapped.Maps) -> None:
    wanted = handover.crossings_in_common(maps, ALL, RATE)
    one, other = (maps.crossings(64, s, ALL) for s in (certainty.FIRST, certainty.SECOND))
    apart = RATE * np.abs(one.time - other.time)
    assert 0.3 < wanted.mean() / (N + 1) < 0.8
    for k, count in enumerate(wanted):
        assert (apart[: count - 1, k] <= handover.HANDOVER).all()
        assert count == N + 1 or apart[count - 1, k] > handover.HANDOVER


@pytest.mark.parametrize("size", [1e-6, 1e-3])
def test_no_wrong_symbol_is_certain_where_states_at_the_handover_are_off(
    size: float, maps: mapped.Maps, truth: Any
) -> None:
    check_honest(decided(maps, Integrated(size)), truth)


@pytest.mark.parametrize("every", [False, True])
def test_no_wrong_symbol_is_certain_where_tables_are_spoilt(every: bool, truth: Any) -> None:
    spoilt = SpoiltMaps(PROBLEM, PHASES, 1e-12, every)
    spoilt.orbits = mapped.THIRDS
    check_honest(decided(spoilt, Integrated()), truth)


def check_honest(found: Decided, truth: Any) -> None:
    wrong = found.crossings.separatrix[1:] != truth.separatrix[1:]
    assert not (found.certain & wrong).any()
    assert (~found.certain).mean() > 0.2, "nothing was in doubt"


def test_what_stays_open_is_left_as_it_was(maps: mapped.Maps) -> None:
    before = maps.crossings(64, certainty.SECOND, ALL)
    found = decided(maps, Integrated(1e-6))
    open_ = ~found.certain.all(axis=0)
    assert open_.any()
    assert np.array_equal(found.crossings.time[:, open_], before.time[:, open_])
    assert (found.bits[open_] == 64).all()


@pytest.mark.parametrize("jobs", [1, 3])
def test_agrees_what_is_reached_with_integration_up_to_there(
    jobs: int, truth: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Long calls find crossings behind those that are wanted.
    monkeypatch.setitem(batch.STEPS, 106, 128)
    wanted = 1 + ALL % 5
    found = RUN._replace(jobs=jobs).reached(certainty.SECOND, ALL, wanted)
    inside = np.arange(5)[:, None] < wanted
    assert np.array_equal(found.separatrix, np.where(inside, truth.separatrix[:5], 0))
    assert np.array_equal(np.isnan(found.time), ~inside)
    assert np.abs(found.time - truth.time[:5])[inside].max() < 1e-13
    assert np.abs(found.state[2]).max() < 1e-18
    # mu r . gamma is conserved with the rest of the energy: gamma keeps its length, in its unit.
    length = np.sqrt((found.state[3:] ** 2).sum(axis=0))
    assert np.abs(length / native(64)("0.73") - 1).max() < 1e-18


def test_an_orbit_is_done_at_its_own_last_crossing(monkeypatch: pytest.MonkeyPatch) -> None:
    carried: list[int] = []
    real = batch.Batch._carried

    def counting(self: batch.Batch, number: int) -> Any:
        carried.append(number * self.columns.size)
        return real(self, number)

    monkeypatch.setattr(batch.Batch, "_carried", counting)
    for wanted in (np.full(ALL.size, 6), np.where(ALL == 0, 6, 1)):
        carried.append(0)
        RUN.reached(certainty.FIRST, ALL, wanted)
    all_, one = (sum(part) for part in np.split(carried, [len(carried) - carried[::-1].index(0)]))
    assert one < all_ / 2


@pytest.mark.slow
def test_orbits_from_several_starts_are_handed_over_like_those_from_one(truth: Any) -> None:
    starts = np.where(ALL % 2, 1e-8, 3e-7)
    many = mapped.Maps(
        RouteProblem(FIG4, exact("1.3342"), exact(3e-7), N),
        PHASES,
        mapped.Starts(starts, 1e-8, mapped.THIRDS),
    )
    integrated = plane.IntegratedStarts(
        RUN, starts, lambda J1_0: replace(RUN.problem, J1_0=exact(float(J1_0)))
    )
    wanted = handover.crossings_in_common(many, ALL, RATE)
    begun = integrated.reached(certainty.SECOND, ALL, wanted)
    found = handover.continued(many, certainty.SECOND, ALL, begun, wanted)
    true = integrated.crossings(106, certainty.FIRST, ALL)
    assert np.array_equal(found.separatrix, true.separatrix)
    assert np.median(np.abs(found.time[-1] - true.time[-1])) < 1e-9
    same = (true.separatrix == truth.separatrix).all(axis=0)
    assert (same == (starts == 1e-8)).mean() > 0.9


def test_few_orbits_have_no_third_map_and_are_integrated_then(
    maps: mapped.Maps, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(maps, "orbits", 1)
    monkeypatch.setattr(certainty, "LINEAR", 0.0)
    monkeypatch.setattr(certainty, "CLOSE", 0.0)
    integrated = Integrated()
    assert decided(maps, integrated).certain.all()
    assert sum(map(len, integrated.crossed)) > 0


@pytest.mark.parametrize(
    ("engine", "precisions", "expected"),
    [("taylor", (53, 106), True), ("taylor", (53, 113), False), ("scipy", (53, 106), False)],
)
def test_orbits_are_handed_over_where_pairs_of_doubles_integrate(
    engine: str, precisions: tuple[int, ...], expected: bool
) -> None:
    run = RUN._replace(arithmetic=Arithmetic(engine, 1e-13, precisions))
    assert run.in_pairs is expected


def test_series_are_cut_off_at_92_bits_on_the_way_to_a_handover(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cut = []

    def reached(orbits: Any, wanted: Any, *, tolerance: float, jobs: int) -> Any:
        # `batch_sections` halves it with every bit above 53.
        cut.append(tolerance * 2.0 ** (53 - 106))
        return Reached(
            np.zeros((2, 1)), np.zeros((2, 1), np.uint8), np.zeros((6, 1), np.longdouble)
        )

    monkeypatch.setattr(batch_sections, "reached", reached)
    for scales in (certainty.FIRST, certainty.SECOND):
        RUN.reached(scales, np.arange(1), np.array([2]))
    in_doubles = [tolerance_of(RUN.arithmetic, 106, x) for x in (certainty.FIRST, certainty.SECOND)]
    assert cut == [2.0 ** (53 - 92) * one for one in in_doubles]
