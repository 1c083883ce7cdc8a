"""The model of what routes cost: its shape, its limits from both sides, and the warning."""

import warnings
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments.bench.problems import drawn
from rigidpend.numbers.exact import PRECISIONS
from rigidpend.orbits.return_map import build
from rigidpend.routes import choice, costs, mapped
from tests.bodies import FIG4, problem

SLOW = problem(Body((2, "1.9", "1.95"), FIG4.r, "0.001"))


def test_tables_pay_for_more_orbits_of_longer_passages() -> None:
    assert costs.budget(problem(), 20_000) == pytest.approx(20 * costs.budget(problem(), 1000))
    assert costs.budget(SLOW, 1000) > 3 * costs.budget(problem(), 1000)
    saved = costs.integration(problem(), (53,)) - costs.by_maps(problem(), (53,))
    assert costs.budget(problem(), 1, (53,)) == pytest.approx(costs.STAKE * saved)
    longer = costs.integration(problem(n_symbols=45), (106,))
    assert longer == pytest.approx(3 * costs.integration(problem(), (106,))), "symbols are alike"


@pytest.mark.parametrize(
    ("A", "mu", "h0", "J1_0", "share"),
    [
        # Of 256 orbits by integration.
        (("2.629", "1.488", "1.731"), "0.00016", 1, "1e-8", 0.195),
        (("2.214", "1.528", "2.042"), "0.0048", 1, "1e-8", 0.418),
        (("1.602", "0.826", "1.029"), "0.00057", 1, "1e-8", 0.105),
        (("2.598", "1.762", "2.518"), "0.0011", 1, "1e-8", 0.684),
        # Of 64 to 192 orbits, whose starts are farther off than surfaces are split.
        ((2, "1.7", "1.85"), "0.001", "1.3342", "1e-4", 0.05),
        ((2, "1.9", "1.95"), "0.001", "1.3342", "1e-8", 0.234),
        (("2.0367", "1.9668", "1.9848"), "0.004", 1, "1.1e-8", 0.61),
        (("2.673", "2.520", "2.527"), "0.00394", 1, "2.2e-10", 1.0),
    ],
)
def test_open_shares_are_as_measured(A: Any, mu: str, h0: Any, J1_0: str, share: float) -> None:
    one = problem(Body(A, (1, 1, 0), mu), h0=h0, J1_0=J1_0)
    assert 1 / 1.7 < costs.share_open(one, 53) / share < 1.7


@pytest.mark.parametrize("n_symbols", [15, 30])
def test_second_maps_in_doubles_pay_where_errors_stay_below_their_limit(
    n_symbols: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = problem(n_symbols=n_symbols)
    # 20 bits of 53 are those of the limit, a millionth of a radian.
    share = 1 - costs.share_open(one, 33, displaced=False)
    for threshold, decided in ((0.99 * share, True), (1.01 * share, False)):
        monkeypatch.setattr(costs, "DECIDED", threshold)
        assert costs.doubles_decide(one) == decided


def test_an_orbit_costs_what_each_precision_takes_of_those_left_open() -> None:
    doubles, both = (costs.integration(SLOW, ladder) for ladder in ((53,), (53, 106)))
    open_, left = (costs.share_open(SLOW, bits) for bits in (53, 106))
    assert 0.1 < open_ < 1
    assert left < 1e-9, "motions are regular, and no error grows by so much"
    # Measured of three bodies.
    assert 0.69 <= costs.CLIMBING <= 0.78
    further = costs.STAYING_OPEN * left + costs.CLIMBING * (open_ - left)
    assert both == pytest.approx(doubles + further * costs.integration(SLOW, (106,)))
    # Measured of several bodies: two, three, four and eight doubles; and of one or two, integers.
    for bits, least, most in (
        (106, 9.7, 13.4),
        (160, 45, 62),
        (161, 110, 178),
        (424, 1_920, 3_070),
        (448, 112_000, 150_000),
        (600, 180_000, 240_000),
    ):
        assert least <= costs.integration(SLOW, (bits,)) / doubles <= most
    # No rung fits between these two.
    near = costs.integration(SLOW, (53, 65)) - doubles
    assert near == pytest.approx(open_ * costs.integration(SLOW, (106,)))


def test_what_rungs_decide_takes_no_time_of_a_far_precision() -> None:
    """Measured of 95 orbits, of which none took more than 76 bits: as long as with the others."""
    far, near = (costs.integration(problem(), x) for x in ((53, 1000), (53, 106, 160, 1000)))
    assert 1 - 1e-9 < far / near < 1.3


def test_maps_save_nothing_of_what_the_last_precision_leaves_open() -> None:
    """Of orbits of 300 symbols none is decided to its end; without more bits maps save all."""
    long = problem(n_symbols=300)
    doubles, mapped = costs.integration(long, (53,)), 300 * costs.MAPPED[costs.SHARPER]
    pairs, three = costs.HANDED_OVER * costs.FACTORS[106], costs.FACTORS[159]
    beyond = costs.STAYING_OPEN * (pairs + three) * doubles
    assert costs.by_maps(long) == pytest.approx(mapped + beyond, rel=1e-3)
    # Measured of 16 orbits each, 1.5 with 200 symbols and 3.4 with 300: rungs take time too.
    ladder = (costs.integration(long, (53, 106)) / doubles - 1) / 11
    assert 1.5 <= ladder <= 3.4
    assert costs.by_maps(long, (53,)) == mapped
    assert costs.by_maps(problem()) < 0.1 * costs.integration(problem())


def test_what_maps_leave_open_is_handed_over_in_a_part_of_the_time() -> None:
    """The displacement of both surfaces costs nothing: a map's coordinates lie between them."""
    long = problem(n_symbols=40)
    # Halfway between maps of 64 and 75 bits.
    open_, left = (costs.share_open(long, bits, displaced=False) for bits in (69, 97))
    assert 0.1 < open_ < 0.9 * costs.share_open(long, 69)
    doubles = costs.integration(long, (53,))
    further = costs.STAYING_OPEN * left + costs.HANDED_OVER * costs.CLIMBING * (open_ - left)
    beyond = costs.by_maps(long, (53, 106)) - 40 * costs.MAPPED[costs.SHARPER]
    assert beyond == pytest.approx(further * costs.FACTORS[106] * doubles)
    assert costs.beyond_maps(long, (53, 106))[1] == pytest.approx(beyond / open_)
    # What they do in their own bits, or in fewer, nothing else does.
    assert costs.by_maps(long, (53, costs.SHARPER, 212)) == costs.by_maps(long, (53, 212))


@pytest.mark.parametrize(
    ("seed", "body", "all_", "open_"),
    [
        (40, 1, 59.6e-6, 3.41e-3),
        (40, 17, 44.5e-6, 2.31e-3),
        (1, 17, 50.3e-6, 2.46e-3),
        (1, 6, 25.4e-6, 2.84e-3),
        # Of the last one the share that stays open is five times the estimate.
        (40, 16, None, 2.38e-3),
    ],
)
def test_orbits_take_as_long_by_maps_as_told(
    seed: int, body: int, all_: float | None, open_: float
) -> None:
    """Processor time of each of 20,000 orbits by kept maps, and of those that maps leave open."""
    one = drawn(seed)[body]
    assert all_ is None or 1 / 1.7 < costs.by_maps(one) / all_ < 1.7
    assert 1 / 1.7 < costs.beyond_maps(one)[1] / open_ < 1.7


def test_what_an_orbit_takes_beyond_the_maps_is_told_where_none_is_expected() -> None:
    alone = problem(SLOW.body, 1)
    assert 0 < costs.share_open(alone, 86, displaced=False) < 1e-200
    # No map has more than 53 bits, so that there are rungs up to 106.
    expected = costs.CLIMBING * costs.HANDED_OVER * costs.integration(alone, (106,))
    assert costs.beyond_maps(alone)[1] == pytest.approx(expected)


@pytest.mark.parametrize("orbits", [1000, 20_000])
def test_orbits_are_expected_to_take_the_cheaper_way(orbits: int, monkeypatch: Any) -> None:
    integrated = orbits * costs.integration(problem())
    by_maps = orbits * costs.by_maps(problem())
    # And of the samples that are integrated once, in doubles and in further bits.
    by_maps += choice.SAMPLE * costs.integration(problem(), (53,)) / 2
    by_maps += choice.LEAST_SAMPLE * costs.integration(problem(), PRECISIONS[:2]) / 2
    most = costs.budget(problem(), orbits)
    # Of maps of 53, 64, 72 and 75 bits; what those take that are made: the sharpest that pay.
    for shares, tables in (
        ((0.1, 0.4, 0.5, 0.59), 0.99),
        ((0.1, 0.4, 0.59, 0.61), 0.99),
        ((0.1, 0.4, 0.61, 0.61), 0.5),
        ((0.49, 0.52, 0.6, 0.6), 0.98),
        ((0.51, 0.6, 0.7, 0.7), None),
    ):
        each = dict(zip((53, 64, 72, 75), shares, strict=True))
        monkeypatch.setattr(mapped, "expected_cost", lambda *x, each=each: each[x[-2]] * most)
        by_either = integrated if tables is None else tables * most + by_maps
        expected = choice.SLOWER * (by_either if orbits > 10_000 else integrated)
        assert choice.expected_seconds(problem(), orbits) == pytest.approx(expected)
    assert choice.expected_seconds(problem(), orbits, (106,)) > 10 * integrated


def test_slow_orbits_come_with_the_reason_where_they_make_all_slow() -> None:
    each = 1.1 * costs.LONG / 10
    told = (
        "10 of 20 orbits are integrated numerically, which takes 110 ms each on a core, some 1.1 s"
        " in all, because they do"
    )
    with pytest.warns(costs.SlowRoutesWarning, match=f"^{told}$"):
        costs.warned(problem(), 10, 20, each, "they do")
    many = int(10 * each / 100e-6)
    with pytest.warns(costs.SlowRoutesWarning):
        costs.warned(problem(), 10, int(0.99 * many), each, "because")
    with warnings.catch_warnings(action="error"):
        # Less than a second in all, and 0.1 ms of each of all.
        costs.warned(problem(), 10, 10, each / 1.2, "because")
        costs.warned(problem(), 10, int(1.01 * many), each, "because")


@pytest.mark.parametrize(
    ("asymmetry", "mu", "never"),
    [
        ("3e-6", "1e-4", False),
        ("1e-6", "1e-4", True),
        ("1e-11", "3e-3", True),
        # Gravity lets heavy ones return.
        ("1e-11", "3e-2", False),
    ],
)
def test_a_body_too_nearly_symmetric_is_told_first_and_is_quick(
    asymmetry: str, mu: str, never: bool
) -> None:
    A = 2, 2 * (1 - Fraction(asymmetry)), 2 - Fraction(asymmetry)
    asked = problem(Body(A, (1, 1, 0), mu), h0="1", n_symbols=5)
    with warnings.catch_warnings(record=True, action="always") as told:
        costs.warned_of_none(asked)
    assert [str(x.message).partition(":")[0] for x in told] == [
        "all symbols stay uncertain"
    ] * never
    # Measured at 1e-11: 3 s, for one orbit or eight; it took minutes.
    assert (costs.integration(asked) < 1) is never
    assert costs.integration(asked) < 100
    pairs, doubles = (costs.integration(asked, (bits,)) for bits in (106, 53))
    assert pairs == pytest.approx(costs.FACTORS[106] * doubles)


def test_the_section_is_as_far_from_either_periodic_orbit() -> None:
    both = "1e-8", "sqrt(2*1.3342*3/4) - 1e-8"
    lower, upper = (costs.to_section(problem(J1_0=J1_0)) for J1_0 in both)
    assert lower == pytest.approx(upper)


def test_without_weight_an_orbit_is_short() -> None:
    free = problem(Body(FIG4.A, FIG4.r, 0))
    assert np.isfinite(costs.integration(free))


def test_calls_after_the_first_estimate_nothing_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """It took a twelfth of the time of 20,000 orbits by kept maps."""
    orbits = 25_000
    first = choice.expected_seconds(problem(), orbits)

    def never(*_: Any) -> Any:
        raise AssertionError("it was estimated before")

    monkeypatch.setattr(build, "orders", never)
    monkeypatch.setattr(costs, "closeness", never)
    assert choice.expected_seconds(problem(), orbits) == first
    with pytest.raises(AssertionError, match="before"):
        choice.expected_seconds(problem(h0="1.33421"), orbits)
