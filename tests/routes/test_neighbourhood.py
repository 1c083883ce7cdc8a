"""Routes beside a reference orbit against integration in as many bits; changes of a symbol."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import Body, RouteCodes
from rigidpend.numbers.exact import GUARD_BITS, Exact, exact
from rigidpend.orbits.integrate import no_crossings
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.neighbours import Walk
from rigidpend.routes import certainty, neighbourhood
from rigidpend.routes.codes import codes_of
from rigidpend.routes.ladder import rungs
from rigidpend.routes.neighbourhood import Bracket, Neighbourhood, NoChange, bisect, narrowed
from rigidpend.routes.problem import RouteProblem, passage_limit, phase_rate
from rigidpend.routes.run import Run, tolerance_of
from tests.bodies import FREE, problem

OTHER = Body(A=("2.1", "0.9", "1.4"), r=("0.3", 1, 0), mu="0.02")
FINEST = 1e-30

# Phases of doubly asymptotic orbits, to the digits of which the tests below take others.
FIRST = "4.70569685313354179683861544506906917650110137862906611871950"
"""Where the first symbol changes (Fig. 4's body)."""


def truth(asked: RouteProblem, phases: Sequence[Exact], *bits: int) -> RouteCodes:
    """By integration of each, certain throughout."""
    found = codes_of(asked, phases, resolve(precisions=bits), 1, "integration")
    assert found.certain.all()
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "centre", "beside", "finest", "own", "bits"),
    [
        # Distances from 1e-2 to 1e-24, both sides.
        (problem(n_symbols=3), FIRST, ("1e-2", "-1e-2", "1.234567e-24", "-1e-24"), FINEST, 53, 130),
        # In higher precision each orbit is integrated.
        (problem(n_symbols=2), FIRST, ("1e-12", "-3e-12"), FINEST, 113, 130),
        # A centre that is not special: the reference leaves the periodic orbit with its neighbours.
        (problem(OTHER, 3, "0.8"), "1.3", ("1e-1", "1e-4", "1e-8", "1e-14"), 1e-14, 53, 113),
        # Without weight all phases share one orbit, which never crosses twice.
        (problem(FREE, 2), "1", ("1e-3",), 1e-10, 53, 53),
    ],
    ids=["every distance", "each integrated", "another body", "no weight"],
)
def test_agrees_with_integration(
    asked: RouteProblem, centre: str, beside: Sequence[str], finest: float, own: int, bits: int
) -> None:
    """Crossing times as doubles alone would have them."""
    phases = [exact(centre) + exact(x) for x in beside]
    arithmetic = resolve(precisions=(own, 160))
    found = Neighbourhood(asked, exact(centre), finest, arithmetic).routes(phases)
    true = truth(asked, phases, bits)
    assert found.certain.all()
    assert set(found.bits) == {own}
    assert np.array_equal(found.codes, true.codes)
    apart = np.nan_to_num(np.abs(found.crossing_time - true.crossing_time))
    assert apart[:2].max() < 1e-11
    assert apart.max() < 1e-3


def test_the_closest_phases_differ_in_all_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the least distance, against differences that have 200 bits more."""
    monkeypatch.setattr(neighbourhood, "ReferenceOrbit", Mock())
    monkeypatch.setattr(neighbourhood, "Walk", walk := Mock(side_effect=NoChange))
    phases = [exact("4.7") + exact(f"{side}1e-30") for side in ("", "-")]
    for finest in (FINEST, FINEST * 2.0**-200):
        with pytest.raises(NoChange):
            Neighbourhood(problem(), exact("4.7"), finest, resolve()).prefixes(phases)
    apart, truly = (given.args[1] for given in walk.call_args_list)
    assert np.abs(apart - truly).max() < 2.0**-52 * np.abs(truly).max()
    assert walk.call_args.args[2] == pytest.approx([1e-30, -1e-30], rel=1e-15, abs=0)


def test_phases_get_the_bits_of_their_distance(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a reference orbit, with its derivative, where the kernel would take longer than that."""
    none, step = no_crossings(1, 1), exact("1e-6")
    orbit = Mock(**{"return_value.followed.return_value": none})
    monkeypatch.setattr(neighbourhood, "ReferenceOrbit", orbit)
    monkeypatch.setattr(Run, "crossings", kernel := Mock(return_value=none))
    around = Neighbourhood(problem(), exact("4.7"), FINEST, resolve())
    for distance in (1e-1, 1e-10, 1e-30, 1e-60, 0):
        around.crossings(106, certainty.FIRST_SCALES, [around.centre + exact(distance)])
    by_kernel = [given.args[0] for given in kernel.call_args_list]
    each = [*by_kernel, *(given.kwargs["bits"] for given in orbit.call_args_list)]
    assert len(set(each[2:])) == 1
    for bits, distance in zip(each[:3], (1e-1, 1e-10, 1e-30), strict=True):
        needed = 106 - math.log2(distance)
        assert needed <= bits <= 2 * (needed + GUARD_BITS)
    assert max(by_kernel) == 212 < min(each[2:])
    orbit.reset_mock()
    for phase in (around.centre - step, around.centre, around.centre + step):
        around.crossings(448, certainty.FIRST_SCALES, [phase])
    (_, before, _), (_, _, tangent), (_, after, _) = (x.args for x in orbit.call_args_list)
    rate = [float(y - x) / 2e-6 for x, y in zip(before, after, strict=True)]
    np.testing.assert_allclose([float(x) for x in tangent], rate, rtol=0, atol=1e-11)
    around.crossings(448, certainty.SECOND_SCALES, [around.centre])
    assert orbit.return_value.followed.call_args.args == (around.problem.n_symbols + 1,)
    asked, unit = orbit.call_args.kwargs, certainty.SECOND_SCALES.time_unit
    assert asked["longest"] * unit == pytest.approx(around.longest, rel=1e-14, abs=0)
    assert asked["tolerance"] == tolerance_of(
        around.arithmetic, asked["bits"], certainty.SECOND_SCALES
    )


def test_the_computations_of_a_precision_share_no_difference(monkeypatch: Any) -> None:
    """But for powers of two all differences are others; so are tolerances, and limits by units."""
    monkeypatch.setattr(neighbourhood, "Walk", walk := Mock(wraps=Walk))
    phases = [exact(FIRST) + exact(f"{k}e-12") for k in (-3, 1)]
    around = Neighbourhood(problem(n_symbols=2), exact(FIRST), 1e-14, resolve(precisions=(53,)))
    assert around.routes(phases).certain.all()
    one, other, *_ = (np.frexp(given.args[1])[0] for given in walk.call_args_list)
    assert (one != other)[one != 0].all()
    tolerances, limits = (
        [given.kwargs[name] for given in walk.call_args_list[:2]]
        for name in ("tolerance", "passage_limit")
    )
    assert len(set(tolerances)) == 2
    units = [x.time_unit for x in (certainty.FIRST_SCALES, certainty.SECOND_SCALES)]
    assert np.multiply(limits, units) == pytest.approx(around.longest, rel=1e-14, abs=0)


@pytest.mark.parametrize("most", [64, 600])
def test_orbits_are_waited_for_as_long_in_doubles_as_in_the_most_bits(most: int) -> None:
    """Or else two computations in doubles would see an orbit stay that comes back in more bits."""
    around = Neighbourhood(problem(), exact(FIRST), FINEST, resolve(precisions=(53, most)))
    bits = max(most, around.bits)
    assert (bits == most) is (most == 600)
    assert around.longest == passage_limit(around.problem, bits)


CHANGE = exact("0.7234567890123456789")


def threshold(phases: Sequence[Exact]) -> list[list[int]]:
    return [[1, int(float(x - CHANGE) > 0)] for x in phases]


@pytest.mark.parametrize(
    ("low", "high", "width"),
    [("0", "1", 0.3), ("0", "1", 1e-3), ("0", "1", 1e-17), ("pi/10", "pi/3", 1e-20)],
)
def test_every_half_holds_the_change(low: str, high: str, width: float) -> None:
    path = bisect(threshold, Bracket(exact(low), exact(high)), width)
    for whole, half in pairwise(path):
        assert half.width == pytest.approx(whole.width / 2, rel=1e-10, abs=0)
        assert {half.low, half.high} & {whole.low, whole.high}
        assert float(half.low - CHANGE) <= 0 < float(half.high - CHANGE)
    assert path[-1].width <= width < path[-2].width
    assert path[-1].low.fraction is not None, "ends that are irrational are not for long"


def both(phases: Sequence[Exact]) -> list[list[int]]:
    """An earlier symbol changes too."""
    return [[1, side, side] for _, side in threshold(phases)]


@pytest.mark.parametrize(
    ("prefixes", "low", "high"),
    [(threshold, "0", "0.5"), (threshold, "0.8", "1"), (both, "0", "1")],
)
def test_no_change_is_told_with_the_symbols(prefixes: Any, low: str, high: str) -> None:
    with pytest.raises(NoChange, match=r"symbol [23] must change, .* it is \[.*Melnikov zeros"):
        bisect(prefixes, Bracket(exact(low), exact(high)), 1e-3)


def test_narrowing_ends_at_a_width_that_is_met(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Neighbourhood, "prefixes", lambda _, phases: threshold(phases))
    # Else it goes on for ever.
    report = Mock(side_effect=[None] * 9)
    whole = Bracket(exact("0"), exact("1"))
    path = narrowed(problem(), whole, 2.0**-60, resolve(), report)
    assert (path[-1].width, len(path)) == (2.0**-60, 61)
    # After each reference orbit.
    told = [given.args[0] for given in report.call_args_list]
    assert told == [2.0**-neighbourhood.GAIN, 2.0**-60]


def test_orbits_side_by_side_agree_by_the_rate_of_their_phase(monkeypatch: Any) -> None:
    monkeypatch.setattr(certainty, "decide", decide := Mock(side_effect=InterruptedError))
    around = Neighbourhood(problem(), exact("4.7"), FINEST, resolve(precisions=(53, 106)))
    with pytest.raises(InterruptedError):
        around.routes([exact("4.7"), exact("4.8")])
    assert decide.call_args.args[1:] == (2, phase_rate(around.problem), rungs((53, 106)))
