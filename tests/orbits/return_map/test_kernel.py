"""Orbits followed by the kernel against the map in full, in doubles and in pairs."""

import math
from dataclasses import replace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.machine.signals import Stopped
from rigidpend.machine.workers import side_by_side
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.sum_arrays import SumArray
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import MapError, ReturnMap, kernel, program, return_map
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.program import Entry, shortened
from tests.bodies import GENERIC
from tests.orbits.integrate.problems import same

ENERGIES = ("1.3332", "1.3352")
N = 203
"""Orbits, not a multiple of the lanes."""
QP = 1.3e-4
CROSSINGS, LATE = 7, 27
BITS = [53, 64]
INTERVAL, POINT = (1e-5, 3e-4), (QP, QP)


@pytest.fixture(scope="module")
def made() -> ReturnMap:
    return return_map(GENERIC, h=ENERGIES, bits=64)


def drawn() -> tuple[Any, Any]:
    """Phases and energies, -1 to 1 in the interval."""
    random = np.random.default_rng(9)
    return random.uniform(0, 6.28, N), random.uniform(-1, 1, N)


def test_starts_have_a_table_as_fine_as_the_normal_form_or_are_outside_of_it(
    made: ReturnMap, monkeypatch: pytest.MonkeyPatch
) -> None:
    nf, a = made.normal_form, precision(64)
    form, starts = TorusForm(nf, a.array([1.3345]), a), program.entry(nf, 1e-5, 0.1, a)
    Qp, psi = a.array([1e-4, 0.03, 0.1]), a.array([1, 3, 5])
    at, seen = form.inverted(psi, Qp, 0 * Qp), starts.table.at(form)
    off = seen.look_up(starts.place(Qp), psi, a) - np.stack((at.v / Qp, at.u / Qp, at.tau))
    assert a.largest(off) < 64 * a.epsilon
    monkeypatch.setattr(program, "MOST_NODES", 7)
    with pytest.raises(MapError, match="the start lies outside of the range of the normal form"):
        program.entry(nf, 1e-5, 0.1, a)


def energy(made: ReturnMap, e: Any) -> Any:
    within = made.normal_form.energies
    return within.centre + within.half_width * precision(made.bits).array(e)


def followed(
    made: ReturnMap,
    bits: int,
    phase: Any,
    e: Any,
    ends: tuple[float, float] = POINT,
    crossings: int = CROSSINGS,
    jobs: int = 1,
) -> Crossings:
    own, a = precision(made.bits), precision(bits)
    given = made.program(bits, *map(own.number, ends))
    Qp, phase, e = (a.array(x) for x in (QP + 0 * phase, phase, e))
    return kernel.follow(given, Qp, phase, e, crossings, jobs)


def in_full(made: ReturnMap, phase: Any, e: Any, crossings: int = CROSSINGS) -> Any:
    """Crossings by the map in full: times, separatrices, if inside of its tables; and points."""
    a, level = precision(made.bits), made.at(energy(made, e))
    begin = level.enter(a.number(QP), a.array(phase))
    point, time, inside, image = begin.point, begin.time, begin.inside, np.zeros(N, dtype=bool)
    found, points = [], []
    for k in range(crossings):
        # Upward beside 2 or its image 4, downward beside 3 or its image 1.
        beside = np.where(image, 1, 3) if k % 2 else np.where(image, 4, 2)
        found.append((time, beside, inside))
        points.append(point)
        passed = level.passage(point)
        time, inside = time + passed.time, inside & passed.inside
        point, image = passed.point, image ^ passed.mirrored
    return *(np.stack(x) for x in zip(*found, strict=True)), points


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("ends", [INTERVAL, POINT], ids=["interval", "point"])
def test_agrees_the_kernel_with_the_map_in_full(
    made: ReturnMap, bits: int, ends: tuple[float, float]
) -> None:
    found = followed(made, bits, *drawn(), ends)
    time, separatrix, inside, _ = in_full(made, *drawn())
    assert inside.all()
    assert (found.separatrix == separatrix).all()
    late = np.abs(found.time - time).astype(float)
    # Doubles store times of 10 with roundings of 2e-15; each passage makes errors grow tenfold.
    assert late[0].max() < 3e-14
    assert np.quantile(late[-1], 0.9) < (1e-9 if bits == 53 else 1e-13)


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("k", [0, 1, 2])
def test_orbits_go_on_from_a_crossing_as_those_that_come_there(
    made: ReturnMap, bits: int, k: int
) -> None:
    """Where they cross the map in full tells."""
    (phase, e), a = drawn(), precision(bits)
    times, separatrices, _, points = in_full(made, phase, e, k + 1)
    last = points[-1]
    x = last.d * (1 / made.charts[last.rising].forward.width)
    image = np.where(np.isin(separatrices[-1], (2, 3)), 1.0, -1.0)
    time = a.array(times[-1])
    at = kernel.UnderWay(last.rising, a.array(x), a.array(last.chi), image, time)
    program = made.program(bits, *map(precision(made.bits).number, POINT))
    further = kernel.go_on(program, at, a.array(e), CROSSINGS - k - 1)
    whole = followed(made, bits, phase, e)
    np.testing.assert_array_equal(further.separatrix, whole.separatrix[k + 1 :])
    late = np.abs(further.time - whole.time[k + 1 :])
    # What they come with has grown since the start, in doubles.
    assert np.quantile(late[0], 0.9) < (1e-11 if bits == 53 else 1e-13)
    assert np.quantile(late[-1], 0.9) < (1e-9 if bits == 53 else 1e-13)


@pytest.mark.parametrize("which", ["forward", "inverse"])
def test_the_kernel_tells_orbits_that_leave_the_tables(
    made: ReturnMap, which: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And that have left come back in no further call."""

    def narrowed(chart: Any) -> Any:
        table = getattr(chart, which)
        return chart._replace(**{which: table._replace(width=table.width * 0.42)})

    down, up = made.charts
    phase, e = drawn()
    for charts in ((narrowed(down), up), (down, narrowed(up))):
        narrow = replace(made, charts=charts)
        found, (*_, inside, _) = followed(narrow, 53, phase, e), in_full(narrow, phase, e)
        assert 0.05 < inside[-1].mean() < 0.95
        assert ((found.separatrix != 0) == inside).mean() > 0.99
        assert (np.isnan(found.time) == (found.separatrix == 0)).all()
        whole = found.outcome == Outcome.COMPLETE
        assert (whole == (found.separatrix[-1] != 0)).all()
        with monkeypatch.context() as in_calls:
            in_calls.setattr(kernel, "AT_ONCE", LANES)
            assert same(followed(narrow, 53, phase, e), found)


def test_a_place_beyond_a_table_or_a_start_beyond_the_normal_form_is_outside(
    made: ReturnMap,
) -> None:
    """Also where the table of invariants has room for it."""
    down, up = (
        x._replace(inverse=x.inverse._replace(width=1e3 * x.inverse.width)) for x in made.charts
    )
    own, x = precision(made.bits), np.array([0.5, 0.9999, 1.0001, -0.9999, -1.0001])
    given = replace(made, charts=(down, up)).program(53, *map(own.number, POINT))
    for rising in (True, False):
        found = kernel.go_on(given, kernel.UnderWay(rising, x, 0 * x, 0 * x + 1, 0 * x), 0 * x, 1)
        assert (found.outcome == Outcome.COMPLETE).tolist() == [True, True, False, True, False]
    scale = 2.0 ** round(math.log2(QP))
    assert given.limits[:, 0].tolist() == [made.normal_form.radius / scale, math.inf, math.inf]
    phase, e = drawn()
    for share, inside in ((1.01, True), (0.99, False)):
        within = given._replace(limits=given.limits.copy())
        within.limits[0, 0] = share * QP / scale
        found = kernel.follow(within, QP + 0 * phase, phase, e, 1)
        assert ((found.outcome == Outcome.COMPLETE) == inside).mean() > 0.9
    # On the stable manifold, and at a phase that is no number.
    for Qp, at in ((0.0, phase), (QP, math.nan * phase)):
        found = kernel.follow(given, Qp + 0 * phase, at, e, 1)
        assert (found.outcome == Outcome.FAILED).all()
        assert np.isnan(found.time).all()


@pytest.mark.parametrize("bits", BITS)
def test_an_orbit_does_not_hang_on_its_neighbours(made: ReturnMap, bits: int) -> None:
    phase, e = drawn()
    together, alone = (followed(made, bits, phase[k], e[k]) for k in (slice(None), slice(4, 5)))
    np.testing.assert_array_equal(together.time[:, 4:5], alone.time)
    # One far outside of the energies spoils none beside it.
    with np.errstate(over="ignore", invalid="ignore"):
        beside = followed(made, bits, phase[4:7], np.array([e[4], 1e6, e[6]]))
    np.testing.assert_array_equal(beside.time[:, [0, 2]], together.time[:, [4, 6]])
    assert np.isnan(beside.time[-1, 1])
    assert beside.separatrix[-1, 1] == 0


@pytest.mark.parametrize("bits", BITS)
def test_the_kernel_follows_in_pieces_between_which_it_may_be_stopped(
    made: ReturnMap, bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    phase, e = (x[:20] for x in drawn())
    whole = followed(made, bits, phase, e)
    # Three groups of orbits, each two crossings at a time; and another run is stopped.
    asked = Mock(side_effect=[None] * 13 + [Stopped])
    monkeypatch.setattr(kernel, "AT_ONCE", 2 * LANES)
    monkeypatch.setattr(kernel, "check_stop", asked)
    assert same(followed(made, bits, phase, e), whole)
    assert asked.call_count == 12
    with pytest.raises(Stopped):
        followed(made, bits, phase, e)


@pytest.mark.parametrize("bits", BITS)
def test_threads_share_orbits_that_are_worth_them_and_change_none(
    made: ReturnMap, bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    phase, e = (x[:20] for x in drawn())
    alone, shared = followed(made, bits, phase, e), Mock(wraps=side_by_side)
    monkeypatch.setattr(kernel, "side_by_side", shared)
    # Three groups of orbits, and one.
    half = 3 * LANES * CROSSINGS // 2
    for n, worth, parts in (
        (20, half, [range(1), range(1, 3)]),
        (20, half + 1, [range(3)]),
        (LANES, 1, [range(1)]),
    ):
        monkeypatch.setattr(kernel, "WORTHWHILE", dict.fromkeys((53, 106), worth))
        found = followed(made, bits, phase[:n], e[:n], jobs=3)
        assert same(found, tuple(x[..., :n] for x in alone))
        assert shared.call_args.args[3] == parts


def test_terms_below_the_threshold_are_left_out() -> None:
    """They are weighed at the end of the range, against the largest of all."""
    for last, terms in ((1.001, 4), (0.999, 2)):
        series = np.array([[0.5, 0.0, 0.0, 0.0], [8.0, 1.0, 0.0, last * 2.0**-7 / 4**3]])
        kept = shortened(series, reach=4.0, threshold=2.0**-10)
        np.testing.assert_array_equal(kept, series[:, :terms])


def test_a_map_does_without_terms_far_below_its_tables_errors(made: ReturnMap) -> None:
    """In doubles without those below their roundings."""
    exact_one = replace(made, errors=made.errors._replace(charts=0, inverse=0, exponents=0))
    assert exact_one.left_out == 2.0 ** -(made.bits + 6 + 2)
    # Those of 96 bits lose an eighth of it, for no sharper ones follow.
    sharpest = [replace(exact_one, bits=bits).left_out for bits in (89, 90, 96, 97)]
    assert sharpest == [2.0**-97, 2.0**-101, 2.0**-101, 2.0**-99]
    rough_one = replace(made, errors=made.errors._replace(charts=12 * 2.0**-32))
    assert rough_one.left_out == 2.0**-32
    least, most = map(precision(made.bits).number, POINT)
    terms = [x.program(53, least, most).values.shape[1] for x in (exact_one, made, rough_one)]
    assert terms[0] == terms[1] > terms[2]
    in_pairs = [made.program(64, least, most, x).values.shape[1] for x in (0.0, 2.0**-60)]
    assert terms[1] < in_pairs[1] < in_pairs[0]


def test_terms_are_left_out_that_come_to_less_than_the_threshold_together() -> None:
    """Terms of 3 and 4 come to 5; the second function has none so small."""
    sizes = np.array([[[4.0, 0.0], [1000.0, 9.0]], [[3.0, 9.0], [6.0, 9.0]]])
    found = [program.negligible(sizes, share * 5 / 1000).tolist() for share in (0.999, 1.001)]
    assert found == [[3, 0], [4, 0]]


@pytest.mark.parametrize("kind", [np.asarray, lambda x: SumArray(np.stack((x, 0 * x)))])
def test_starts_have_places_from_end_to_end(kind: Any) -> None:
    Qp = kind(np.array([0.0, 1.0, 2.0, 3.0, 3.0001]))
    table: Any = None
    found = Entry(kind(np.array(2.0)), kind(np.array(1.0)), table).place(Qp)
    np.testing.assert_array_equal(np.asarray(found.astype(float)), [-1, -1, 0, 1, 1])
    at_once = Entry(kind(np.array(2.0)), kind(np.array(0.0)), table).place(Qp)
    assert not np.asarray(at_once.astype(float)).any()


def late(made: ReturnMap, **changes: float) -> Any:
    """Times of late crossings in pairs: each passage makes errors grow by a factor of some ten."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in changes.items():
            patch.setattr(program, name, value)
        return followed(replace(made), 64, *drawn(), crossings=LATE).time[-1]


def apart(one: Any, other: Any) -> float:
    return float(np.nanmedian(np.abs(one - other).astype(float)))


def test_what_is_summed_in_doubles_loses_less_than_what_is_left_out(made: ReturnMap) -> None:
    pairs = late(made, HEADROOM=math.inf)
    mixed = apart(pairs, late(made, HEADROOM=program.HEADROOM))
    too_few, left_out = (
        apart(pairs, x)
        for x in (late(made, HEADROOM=2.0**-4), in_full(made, *drawn(), LATE)[0][-1])
    )
    assert 0 < mixed < left_out < too_few


@pytest.mark.parametrize("bits", BITS)
def test_bases_are_above_all_terms_of_a_table(made: ReturnMap, bits: int) -> None:
    given = made.program(bits, *map(precision(made.bits).number, INTERVAL))
    ends = np.cumsum(given.lengths[:, 0])
    for leg in given.legs:
        for rows, _, triple, _, listed, *_ in (leg[:7], leg[7:14]):
            after = triple + rows + 2 * given.harmonics[listed : listed + rows, 0].sum()
            terms = given.values[0, ends[triple] - given.lengths[triple, 0] : ends[after - 1]]
            own = given.bases[triple:after]
            assert (own == own[0]).all()
            np.testing.assert_allclose(own[0], program.BASE * np.abs(terms).sum(axis=0), rtol=1e-12)
    assert program.BASE > 3


def test_few_terms_are_summed_in_pairs_and_in_doubles_none(made: ReturnMap) -> None:
    shares = []
    for bits in (53, 64):
        given = made.program(bits, *map(precision(made.bits).number, POINT))
        own = [x[:, 1].sum() / x[:, 0].sum() for x in (given.harmonics, given.lengths)]
        shares.append(own)
        # Three doubles for each triple, and a further part where it is read in pairs.
        parts = len(given.values)
        assert given.vectors == 3 * len(given.lengths) + 3 * (parts - 1) * given.lengths[:, 2].sum()
    assert not any(shares[0])
    assert 0 < max(shares[1]) < 0.4
