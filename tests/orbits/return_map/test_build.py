"""Maps built, refused with a reason, and kept on disk."""

import functools
import math
from pathlib import Path
from typing import Any, cast
from unittest.mock import MagicMock, Mock

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments.bench.problems import drawn
from rigidpend.machine.workers import WorkerError, apart
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import Precision, in_triples, precision
from rigidpend.orbits.return_map import (
    MapError,
    ReturnMap,
    build,
    charts,
    checks,
    return_map,
    storage,
)
from rigidpend.orbits.return_map.build import FIRST, SECOND, THIRD, WITH_THETA3, Design
from rigidpend.orbits.return_map.charts import Arcs, arc_ends, free_growth, section_chart
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import Interval
from rigidpend.orbits.return_map.normal_form import NormalForm, normal_form
from rigidpend.orbits.return_map.poincare import rotation_phase
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.orbits.return_map.tables import ChartTable
from scripts import stated_maps
from tests.bodies import FIG4, GENERIC

H = "1.3342"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    storage.kept_map.cache_clear()
    return tmp_path / "rigidpend" / "maps"


def same(a: ReturnMap, b: ReturnMap) -> bool:
    """True if numbers of two maps are equal and laid out alike, so that products round alike."""

    def arrays(made: ReturnMap) -> list[Any]:
        form, tables = made.normal_form, [x.values for chart in made.charts for x in chart]
        found = [form.odd, form.even, form.exponent, form.rotation, *tables]
        return [getattr(x, "parts", x) for x in found]

    pairs = zip(arrays(a), arrays(b), strict=True)
    return all(np.array_equal(x, y) and x.strides == y.strides for x, y in pairs)


GRIOLI = ((2, 1, "1.5"), (1, 1, 0))
HEAVY, NARROW = Body(*GRIOLI, "0.5"), FIRST._replace(narrower=8)
HESS = Body((2, 1, "1.5"), (1, "sqrt(2)", 0), "0.001")
SLOW = Body(("2.953", "2.566", "2.915"), ("0.212", "0.977", 0), "0.00265")


def test_energies_need_as_many_nodes_as_phases_turn_with_them() -> None:
    """Of a nearly symmetric body two nodes less err by more than is allowed."""
    problem = drawn(1, 20)[5]
    assert problem.body.mu == exact("0.00247")
    task = problem.body, *problem.energies, 72, FIRST
    _, planned = build.plan(*task)
    assert planned.n_energy == 12
    assert build.build(*task).orders == planned


@pytest.mark.parametrize(
    ("body", "h", "bits", "design"),
    [
        *((Body(*GRIOLI, mu), H, 53, x) for mu in ("1e-6", "0.01") for x in (FIRST, SECOND)),
        *((FIG4, H, 64, x) for x in (FIRST, SECOND, THIRD)),
        # The weight turns 75 times on the arcs: theta3's quadrature must follow that.
        (SLOW, "0.8617", 64, SECOND),
        # One of the surfaces does not split: the fourth part of a chart is 1e-9 of the others.
        pytest.param(HESS, H, 64, WITH_THETA3, marks=pytest.mark.slow),
    ],
)
def test_order_a_map_errs_by_less_than_the_rounding_of_its_bits(
    body: Body, h: str, bits: int, design: Design
) -> None:
    """Which is what the rule for two precisions asks for: two thousand times less than doubles."""
    errors = return_map(body, h=h, bits=bits, design=design).errors
    allowed = 1e-12 if bits == 53 else 2.0**-bits
    assert max(errors.charts, errors.inverse, errors.exponents) < allowed
    # Floquet's exponents are in doubles; of one energy there is no tail.
    assert (errors.floquet < 1e-12, errors.tail_energy) == (True, 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lot", "design", "least"),
    [
        ((), WITH_THETA3, 0.05),
        # Between energies, in an inverse chart, it errs most.
        ((17,), WITH_THETA3, 0.05),
        # Tables of one energy add little to what held-out arcs share: the normal form's error.
        ((33, 104, 34), FIRST, 0.75),
    ],
    ids=["generic", "by lot", "one energy"],
)
def test_order_tables_err_by_less_than_is_stated_and_not_by_far(
    lot: tuple[int, ...], design: Design, least: float
) -> None:
    """At 400 points, beside a normal form of more terms; of one energy the charts alone."""
    body, h = GENERIC, cast("Any", ("1.3332", "1.3352"))
    if lot:
        problem = drawn(*lot[1:])[lot[0]]
        body, h = problem.body, problem.h0 if lot[1:] else problem.energies
    charts, inverse = stated_maps.ratios(return_map(body, h=h, bits=64, design=design))
    assert least < charts.max() < 1
    assert lot[1:] or least < inverse.max() < 1


@pytest.mark.slow
def test_inverse_charts_err_more_between_the_points_that_measure_it() -> None:
    problem = drawn(3, 14)[13]
    made = return_map(problem.body, h=problem.energies, bits=64, design=FIRST)
    _, inverse = stated_maps.ratios(made)
    # `ratios` holds it against the sum of what both charts state.
    true = inverse.max() * (made.errors.inverse + made.errors.charts)
    assert made.errors.inverse / checks.INVERSE_FACTOR < true < made.errors.inverse


def test_a_map_is_shown_in_two_lines() -> None:
    made = return_map(FIG4, h=("1.3332", "1.3352"))
    worst = max(made.errors.charts, made.errors.inverse, made.errors.exponents)
    first, second = repr(made).splitlines()
    # A map that is there already has its body's numbers as they were written then.
    assert (first, made.body) == (f"<ReturnMap of {made.body!r},", FIG4)
    assert second == f" h = 1.3332 to 1.3352, 53 bits, errors of its tables up to {worst:.2g}>"


def test_programs_of_the_same_starts_share_their_table() -> None:
    made, starts = return_map(FIG4, h=H), (1e-5, 2e-5)
    one, other = made.program(53, *starts), made.program(53, *starts, coarse=1e-9)
    assert one is made.program(53, *starts)
    assert one is not other
    assert one.starts is other.starts is not made.program(53, 1e-5, 3e-5).starts


@pytest.mark.parametrize(
    ("body", "given", "error", "reason"),
    [
        (Body((2, "1.5", "1.8"), (0, 1, 0), "0.7"), {"h": 1}, MapError, "not hyperbolic"),
        (Body((2, "1.5", "1.8"), (0, 1, 0), "0.95"), {"h": 1}, MapError, "theta1 turns 1 times"),
        # It is hyperbolic, by multipliers of 157.7 and its inverse.
        (Body((5, 2, "3.5"), (3, 1, 0), "0.9"), {"h": 1}, MapError, "frame is found: mu is too la"),
        # By an even number of turns no multiplier becomes negative.
        (Body((2, "4.5e-7", "1.9999998"), (1, 0, 0), "2e-4"), {"h": 1}, MapError, "turns -1[46] "),
        (
            Body(("1.965", "0.689", "1.942"), (61, 79, 0), "0.06"),
            {"h": "1.08"},
            MapError,
            "cannot be inverted at the ends",
        ),
        (
            Body((2, "0.0273", "1.976"), (5.33, 3.97, 0), "0.0038"),
            {"h": 1},
            MapError,
            "mu is too large: an orbit from the section does not reach",
        ),
        *((Body(*GRIOLI, 0), {"design": x}, MapError, "mu = 0") for x in (FIRST, NARROW)),
        (FIG4, {"h": "1e-4"}, MapError, "h0 > mu"),
        (FIG4, {"h": ("1.34", "1.33")}, ParameterError, "ascend"),
        (FIG4, {"h": (1, "1.01e6")}, ParameterError, "h = 1.01e6 is outside of 1e-06 to 1e"),
        (Body(*GRIOLI, 0), {"h": "0.99e-6"}, ParameterError, "h = 0.99e-6 is outside of"),
        (FIG4, {"design": "1"}, ParameterError, "design must be a Design"),
    ],
)
def test_what_a_map_does_not_resolve_or_take_is_refused_with_the_reason(
    body: Body, given: Any, error: type[Exception], reason: str
) -> None:
    with pytest.raises(error, match=reason):
        return_map(body, **({"h": H} | given))


def test_orders_are_raised_until_tables_settle_and_those_that_do_not_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    task = FIG4, exact(H), exact(H), 53
    by, first = build.plan(*task, FIRST), build.build(*task)
    largest = first.errors.largest

    def settled(allowed: float, attempts: int) -> Any:
        monkeypatch.setattr(build, "ALLOWED_ROUNDINGS", allowed * 2.0**53)
        monkeypatch.setattr(build, "ATTEMPTS", attempts)
        return build.build(*task, by=by).orders

    assert settled(1.01 * largest, 1) == first.orders == by[1]
    assert settled(largest, 2) == first.orders.larger(first.errors, largest) != first.orders
    told = f"in the last of 1 attempts they err by {largest:.2g} .* and {largest:.2g} is allowed"
    with pytest.raises(MapError, match=f"the tables don't settle: {told}"):
        settled(largest, 1)


def test_a_map_of_another_exponent_than_its_orbit_s_is_refused(monkeypatch: Any) -> None:
    seen, off = checks.measured, iter((0.99e-11, 1.01e-11))
    monkeypatch.setattr(build, "measured", lambda *x: seen(*x)._replace(floquet=next(off)))
    assert build.build(FIG4, exact(H), exact(H), 53).errors.floquet == 0.99e-11
    with pytest.raises(MapError, match="Lambda_0 differs from the Floquet exponent by 1e-11"):
        build.build(FIG4, exact(H), exact(H), 53)


@pytest.mark.parametrize(("bits", "attempts"), [(53, 3), (90, 2)])
def test_no_further_terms_are_tried_where_they_give_nothing_in_the_most_bits(
    monkeypatch: pytest.MonkeyPatch, bits: int, attempts: int
) -> None:
    """Tables of fewer bits than pairs have are made again in all of these first."""
    monkeypatch.setattr(checks, "held_out", held := Mock(return_value=(1e-3, 1e-3)))
    with pytest.raises(MapError, match=f"in the last of {attempts} attempts they err by 0.001"):
        build.build(FIG4, exact(H), exact(H), bits)
    # Downward and upward, where each attempt halves the error they go on to the fourth.
    assert held.call_count == 2 * attempts
    held.side_effect = [(0.49**k, 0) for k in range(4) for _ in range(2)]
    with pytest.raises(MapError, match="in the last of 4 attempts"):
        build.build(FIG4, exact(H), exact(H), bits)


@pytest.mark.slow
def test_what_was_found_is_kept_and_not_sought_again(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A map, with a bit of each number that is zero, and the reason why there is none."""
    asked: Any = {"bits": 64, "design": FIRST}
    made = return_map(FIG4, h=("1.32", "1.348"), **asked)
    # Terms of high degree lack some orders in energy and phase.
    tables = [table.values for chart in made.charts for table in chart]
    arrays = [*made.normal_form.series, *tables]
    size, used = sum(x.size for x in arrays), sum((abs(x) > 0).sum() for x in arrays)
    assert used < 0.9 * size
    [path] = cache.iterdir()
    assert path.stat().st_size - 16 * used < size / 8 + 20_000
    with pytest.raises(MapError) as first:
        return_map(HEAVY, h=H)
    assert len(list(cache.iterdir())) == 2
    storage.kept_map.cache_clear()
    monkeypatch.setattr(storage, "build", lambda *_: pytest.fail("built again"))
    # The same numbers, written otherwise.
    alike, ends = Body((2, 1, "3/2"), (1, 1, 0), "1e-3"), (exact("1.32").fraction, "1.348")
    again = return_map(alike, h=ends, **asked)
    assert same(made, again)
    for name in ("errors", "orders", "energies", "coefficients"):
        assert getattr(again, name) == getattr(made, name)
    with pytest.raises(MapError) as second:
        return_map(HEAVY, h=H)
    assert str(second.value) == str(first.value)


def test_a_map_over_its_budget_is_refused_and_that_is_kept(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another call with the same budget has the same answer, whatever is kept."""
    h = exact(H)
    needed = build.expected_cost(FIG4, h, h, 53, WITH_THETA3)
    assert 0.001 < needed < 1
    told = f"would take {needed:.2g} s of a core at least, more than the {0.9 * needed:.2g} s that"
    monkeypatch.setattr(build, "normal_form", lambda *_, **__: pytest.fail("tables are made"))
    for _ in range(2):
        with pytest.raises(build.Costly, match=told):
            return_map(FIG4, h=H, budget=0.9 * needed)
        storage.kept_map.cache_clear()
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache.parent.parent))
    assert return_map(FIG4, h=H, budget=2 * needed).cost == needed
    storage.kept_map.cache_clear()
    with pytest.raises(build.Costly, match=told):
        return_map(FIG4, h=H, budget=0.9 * needed)
    assert return_map(FIG4, h=H).cost == needed


@pytest.mark.slow
def test_a_map_by_a_process_is_the_same_and_is_kept(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends = exact(H), exact(H)
    here, elsewhere = build.build(GENERIC, *ends, 53, FIRST), Mock(wraps=apart)
    monkeypatch.setattr(storage, "apart", elsewhere)
    storage.build_apart(GENERIC, ends, 53, FIRST, math.inf)
    assert same(return_map(GENERIC, h=H, design=FIRST), here)
    assert len(list(cache.iterdir())) == 1
    least = build.expected_cost(GENERIC, *ends, 53, SECOND) / 2
    with pytest.raises(build.Costly, match=f"more than the {least:.2g} s"):
        storage.build_apart(GENERIC, ends, 53, SECOND, least)
    with pytest.raises(MapError, match="cannot be inverted at the ends"):
        storage.build_apart(HEAVY, ends, 53, FIRST, math.inf)
    assert elsewhere.call_count == 2
    for work, task in (call.args for call in elsewhere.call_args_list):
        assert (work, task[-1]) == (build.build, build.plan(*task[:5])), "looks are taken once"


@pytest.mark.parametrize("error", [WorkerError, OSError, ImportError, NotImplementedError])
def test_a_map_is_built_here_where_no_process_can_be_had(
    error: type[Exception], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(storage, "apart", Mock(side_effect=error))
    monkeypatch.setattr(storage, "build", Mock(side_effect=MapError("tried here")))
    with pytest.raises(MapError, match="tried here"):
        storage.build_apart(GENERIC, (exact(H), exact(H)), 53, FIRST, math.inf)
    assert len(list(cache.iterdir())) == 1


BY = 1e-6
"""An error that tables are given, relative."""


def spoilt(table: ChartTable, k: int, by: float = 0.0, I_off: float = 0.0, s: float = 0.0) -> Any:
    """A table that errs in function k, or gives the point with other invariants and its time."""

    class Off(ChartTable):
        """The table with errors."""

        def look_up(self, x: Any, phase: Any, a: Precision) -> Any:
            found = super().look_up(x + I_off * self.width, phase + s, a)
            found[k] *= 1 + by
            found[1] += s
            return found

    return Off(*table)


@pytest.mark.parametrize("rising", [False, True], ids=["downward", "upward"])
def test_the_stated_error_of_a_chart_is_its_factor_times_that_of_each_of_its_functions(
    rising: bool,
) -> None:
    """Relative to the largest value of the function, or to the width of I; s is in radians."""
    a, made = precision(53), return_map(FIG4, h=H)
    c, chart = coefficients(FIG4.angles(113), "1", a), made.charts[rising]

    def stated(**tables: ChartTable) -> tuple[float, float]:
        arcs = Arcs(a.number(made.orders.length), c, a)
        return checks.held_out(rising, chart._replace(**tables), made.normal_form, arcs, a)

    for k in range(4):
        off, _ = stated(forward=spoilt(chart.forward, k, BY))
        assert off == pytest.approx(checks.CHART_FACTOR * BY, rel=1e-6)
        # The first two of an inverse chart are the point, whose invariants are to be as given.
        if k > 1:
            _, off = stated(inverse=spoilt(chart.inverse, k, BY))
            assert off == pytest.approx(checks.INVERSE_FACTOR * BY, rel=2e-3)
    for beside in ({"I_off": BY}, {"s": BY}):
        _, off = stated(inverse=spoilt(chart.inverse, 0, **beside))
        assert off == pytest.approx(checks.INVERSE_FACTOR * BY, rel=1e-6)


def test_points_at_which_a_map_is_checked_fill_its_tables_and_their_corners() -> None:
    """Corners at both ends of the energies, which come last."""
    share, turn, counts = checks.points(np.random.default_rng(0), 50)
    assert counts == [50] * checks.LEVELS + [2 * checks.CORNERS] * 2
    assert sum(counts) == share.size == turn.size
    for places in (share, turn):
        within = places[: -sum(counts[-2:])]
        assert -1 <= within.min() < -0.9 < 0.9 < within.max() <= 1
    for ends in (slice(-sum(counts[-2:]), -counts[-1]), slice(-counts[-1], None)):
        places = set(zip(share[ends].tolist(), turn[ends].tolist(), strict=True))
        phases = {(2 * k + 1) / checks.CORNERS - 1 for k in range(checks.CORNERS)}
        assert places == {(side, phase) for side in (-1, 1) for phase in phases}


def test_tails_are_relative_to_the_largest_of_their_function() -> None:
    """Of cosines and sines of the last harmonic, at the last polynomials of d and of the energy."""
    values = np.zeros((2, 3, 5, 2))
    values[0, 0, 0] = 10, -2
    values[0, 0, 3, 0], values[0, 2, 0, 1], values[1, 0, 0, 0] = 1, -1, 0.2
    table: Any = Mock(values=values, n_x=3, n_phase=5)
    assert checks.tails(table) == (0.5, 0.1, 0.02)
    assert checks.tails(Mock(values=values[:1], n_x=3, n_phase=5)) == (0.5, 0.1, 0.0)


@pytest.mark.parametrize("rising", [False, True], ids=["downward", "upward"])
def test_a_map_is_checked_at_energies_all_over_by_arcs_longer_by_a_twentieth(
    rising: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One energy in each of equal parts, and both ends; other arcs would end as the charts' own."""
    a, made = precision(53), return_map(FIG4, h=("1.3332", "1.3352"))
    monkeypatch.setattr(checks, "TorusForm", form := Mock(wraps=TorusForm))
    monkeypatch.setattr(checks, "section_chart", ends := Mock(side_effect=InterruptedError))
    arcs = Arcs(4.0, coefficients(FIG4.angles(), "1", a), a)
    with pytest.raises(InterruptedError):
        checks.held_out(rising, made.charts[rising], made.normal_form, arcs, a)
    *within, high, low = form.call_args.args[1]
    assert (low, high) == pytest.approx((1.3332, 1.3352), rel=1e-15)
    parts = (np.array(within) - low) / (high - low) * checks.LEVELS
    np.testing.assert_array_equal(np.floor(parts), np.arange(checks.LEVELS))
    longer = ends.call_args.args[-1]
    assert longer == arcs._replace(length=longer.length)
    assert longer.length == pytest.approx(4.2)


@functools.cache
def of_few_terms(a: Precision) -> tuple[Any, NormalForm]:
    """Coefficients of Fig. 4's body, and a normal form of it that is soon made."""
    c = coefficients(FIG4.angles(160), "1", a)
    return c, normal_form(c, Interval(a.number(1.3342), a.number(0.001), 3), 9, 9, 0.1, a)


@pytest.mark.parametrize("rising", [False, True])
@pytest.mark.parametrize(("bits", "off"), [(53, 1e-13), (96, 1e-28), (113, 1e-32)])
def test_arcs_from_one_chi_end_at_one_phase(rising: bool, bits: int, off: float) -> None:
    a = precision(bits)
    h, (c, nf) = a.array([1.3342, 1.3337]), of_few_terms(a)
    # Three points of each chi at one energy, and two at the other.
    d = a.array([-0.001, 0, 0.001, -0.001, 0, 0.001, -0.0005, 0.0005])
    chi, counts = a.array([0.5, 0.5, 0.5, 3, 3, 3, 2, 2]), [6, 2]
    form = TorusForm(nf, h, a, counts, shared=[3, 2])
    arcs = Arcs(a.number(6.0), c, a)
    path, time, late, turned, at = arc_ends(rising, d, chi, form, arcs, a.array([0.5]))
    end = states_at(c.aligned, path[:, 0], (time / 2 + late)[None], bits)[:, 0]
    missing = rotation_phase(end, c, a) - chi - turned
    assert a.largest(a.sin(missing / 2)) < off
    assert a.largest(turned[:6] - turned[0]) == a.largest(turned[6:] - turned[6]) == 0
    side = 1 if rising else -1
    free = free_growth(side, a.number(6.0), np.repeat(h, counts), c, a)
    assert a.largest(turned - free) < off
    # u and v there belong to each point's own end.
    alone = TorusForm(nf, h, a, counts).inverted(chi + turned, end[0], end[1])
    assert a.largest(np.stack([at.u - alone.u, at.v - alone.v])) < off


@pytest.mark.parametrize("rising", [False, True])
def test_phases_at_the_ends_of_arcs_are_sharp_whatever_doubles_lead_there_and_less_than_a_turn(
    rising: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A rest of 3.6e-15 would leave some roundings of pairs, with much weight, along its tangent.

    A part of the larger of u and v turns with the phase, and the smaller one is to be kept beside.
    """
    a, seen = precision(96), list[Any]()
    h, c = a.array([1.3342]), coefficients(Body(*GRIOLI, "0.05").angles(160), "1", a)
    nf = normal_form(c, Interval(h[0], 0 * h[0], 1), 9, 9, 0.1, a)

    class Watched(TorusForm):
        """Tells the phases at which points are put into the normal form."""

        def inverted(self, psi: Any, *beside: Any) -> Any:
            seen.append(psi)
            return super().inverted(psi, *beside)

    def late(c: Any, states: Any, times: Any, bits: int = 53) -> Any:
        return states_at(c, states, times + 3.6e-15 * (bits == 53 and abs(times[0, 0]) > 1), bits)

    monkeypatch.setattr(charts, "states_at", late)
    d, chi = a.array([-0.001, 0, 0.001]), a.array([0.5, 3, 6])
    arcs = Arcs(a.number(4.0), c, a)
    path, _, rest, turned, _ = arc_ends(rising, d, chi, Watched(nf, h, a), arcs, a.array([0.5]))
    missing = rotation_phase(states_at(c.aligned, path[:, -1], rest[None], 96)[:, 0], c, a)
    assert a.largest(a.sin((missing - chi - turned) / 2)) < 2.0**-103
    assert a.largest(seen[0]) < 3.15 < a.largest(chi + turned)
    assert a.largest(a.sin((seen[0] - chi - turned) / 2)) < 2.0**-103


@pytest.mark.parametrize("rising", [False, True])
def test_charts_are_pairs_with_all_their_digits_whatever_an_arc_begins_with_and_runs_in(
    rising: bool,
) -> None:
    """A slightly longer arc is estimated in doubles with other roundings.

    theta3, a sum over the arc, has none of them.
    """
    a, sharp = precision(96), in_triples(124)
    (c, nf), sharper = of_few_terms(a), coefficients(FIG4.angles(200), "1", sharp)
    form = TorusForm(nf, a.array([1.3342]), a)
    given = rising, a.array([-0.001, 0.001]), a.array([0.5, 3]), form
    one, longer, in_sums = (
        section_chart(*given, Arcs(a.number(length), x, own))
        for length, x, own in ((6.0, c, a), (6.0 + 1e-13, c, a), (6.0, sharper, sharp))
    )
    assert one.parts.shape == in_sums.parts.shape == (2, 4, 2)
    assert a.largest(one - longer) < 1e-25
    assert a.largest(one - in_sums) < 1e-26


@pytest.mark.parametrize("side", [1, -1])
def test_an_arc_that_is_longer_by_a_turn_ends_a_turn_later(side: int) -> None:
    a = precision(53)
    h, c = 1.3342, coefficients(FIG4.angles(113), "1", a)
    turn = 2 * math.pi / math.sqrt(2 * h * float(c.aligned.kappa))
    first, second = (free_growth(side, x, h, c, a) for x in (5.0, 5.0 + turn))
    assert second - first == pytest.approx(2 * math.pi * side)


def test_terms_are_left_out_by_what_a_map_of_its_bits_may_err(monkeypatch: Any) -> None:
    """Of tables and of the normal form; terms below the roundings of a map gain nothing."""
    monkeypatch.setattr(build, "_looked", lambda *_: (None, MagicMock(), None))
    monkeypatch.setattr(build, "orders", planned := Mock())
    # From 91 bits on tables have no more bits than the map.
    given = (53, 9), (64, 0), (64, 9), (90, 0), (91, 9), (113, 0)
    for bits, narrower in given:
        build.plan(FIG4, exact(H), exact(H), bits, FIRST._replace(narrower=narrower))
    found = [[math.log2(x) for x in call.args[-2:]] for call in planned.call_args_list]
    assert found == [[-53, -48], [-72, -69], [-77, -69], [-98, -95], [-91, -86], [-113, -108]]


def test_charts_have_the_widths_of_the_layer_and_the_nodes_of_their_orders() -> None:
    """The chart of downward crossings is of another width than that of upward ones."""
    task = FIG4, exact(H), exact(H), 53, SECOND
    layer, planned = build.plan(*task)
    planned = planned._replace(n_phase_inverse=planned.n_phase + 2)
    assert layer.widths[0] != pytest.approx(layer.widths[1], rel=1e-3)
    made = build.build(*task, by=(layer, planned))
    for (forward, inverse), width in zip(made.charts, layer.widths, strict=True):
        assert (forward.width, inverse.width) == (width, layer.widest_I)
        assert (forward.n_x, forward.n_phase) == (planned.n_x, planned.n_phase)
        assert (inverse.n_x, inverse.n_phase) == (planned.n_x, planned.n_phase_inverse)


@pytest.mark.parametrize("turned", [1, -1])
def test_errors_of_a_map_are_the_largest_of_both_sections(turned: int, monkeypatch: Any) -> None:
    """In whichever section they are."""
    sections, cut = [(1.0, 2.0), (3.0, 4.0)], [(0.1, 0.2, 0.3), (0.4, 0.1, 0.1), (0.2, 0.6, 0.5)]
    monkeypatch.setattr(checks, "held_out", seen := Mock(side_effect=sections[::turned]))
    monkeypatch.setattr(checks, "tails", Mock(side_effect=[*cut, cut[0]][::turned]))
    # Lambda_0 in the middle of the energies, where the polynomials are 1, 0 and -1: 0.6.
    rates = np.array([[0.7], [0.2], [0.1]])
    nf: Any = Mock(disagreement=0.25, exponent=rates, energies=Interval(1.0, 0.5, 3))
    charts: Any = (("down", "its inverse"), ("up", "its inverse"))
    found = checks.measured(charts, nf, Mock(), 0.5, precision(53))
    assert found.floquet == pytest.approx(0.1)
    assert found == checks.Errors(0.25, found.floquet, 3.0, 4.0, 0.4, 0.6, 0.5)
    assert [call.args[:2] for call in seen.call_args_list] == [(0, charts[0]), (1, charts[1])]
