"""Symbols of whole intervals of starts: proven by both checkers, against 113 bits, and spoilt."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from flint import arb, ctx

from rigidpend import Body, route_codes
from rigidpend.experiments.route_intervals import compute
from rigidpend.numbers.exact import exact
from rigidpend.results import store
from rigidpend.routes.certified import interval_search, intervals, pieces
from rigidpend.routes.certified.checker import Undecided
from rigidpend.routes.certified.horseshoe import ShiftProblem
from rigidpend.routes.certified.interval_search import ProvenInterval, within
from rigidpend.routes.certified.intervals import EnclosedStarts, PhaseInterval
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.pieces import FamilyStep
from rigidpend.runs import certificates, loading
from scripts import check_full_shift
from scripts import check_intervals as script
from scripts.check_certificate import Fails, Refused
from tests.attacks import lot
from tests.cli.calls import REFERENCE, call
from tests.remembered import Inline, remembered
from tests.routes.certified.offered import BITS, BODY, H0, J1, Start, agree, constant, said, step

GIVEN = Start().given
CONFIG = Path(__file__).parents[3] / "configs" / "fig4_intervals.yaml"
SETTING = ShiftProblem(BODY, H0, 1, h0=H0)
ONE, TWO = (SETTING, J1, 1, 4), (SETTING, J1, 2, 6)


@pytest.fixture(scope="module")
def one() -> ProvenInterval:
    """One symbol of the starts from 0 to pi/8."""
    [found] = within(PhaseInterval(0, 4), *ONE)
    return found


@pytest.fixture(scope="module")
def two() -> list[ProvenInterval]:
    """Two symbols, and one beside a place where the first one changes."""
    return [x for k in (1, 8) for x in within(PhaseInterval(k, 5), *TWO)]


@pytest.mark.parametrize(
    ("told", "code"),
    [
        ([-1, (True, 1), 1, (False, 1), -1], [True]),
        ([-1, (True, 1), 1, (False, -1), -1], [False]),
        ([-1, -1, (True, 1), (True, 1), 1, 1], []),
        # Runs of one kind beside each other, of the other sign, or without an end.
        ([-1, (True, 1), (True, -1)], None),
        ([-1, 1, (True, 1)], None),
        ([-1, 1, (True, 1), (False, 1), -1], None),
        ([1, (False, 1), -1], None),
        ([-1, (True, 1)], None),
        ([-1, (False, 1), 1], None),
    ],
)
def test_runs_take_turns(told: list[int | tuple[bool, int]], code: list[bool] | None) -> None:
    if code is None:
        with pytest.raises(Undecided, match="H4"):
            intervals.symbols_of(told)
    else:
        assert intervals.symbols_of(told) == code


def both(of: PhaseInterval, steps: list[FamilyStep]) -> list[Callable[[], Any]]:
    """What the first symbol of an interval is, which is 0, by both."""

    def by_package() -> None:
        assert intervals.symbols(EnclosedStarts.of(BODY, H0, J1), of, steps) == [False]

    def by_script() -> None:
        assert script.prove(GIVEN, of.place, of.depth, [step(x) for x in steps]) == [0]

    return [by_package, by_script]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("of", "kept", "wanted"),
    [
        ((0, 4), slice(None), ""),
        ((0, 4), slice(-1), "H4"),
        ((0, 4), slice(1, None), "H3"),
        ((0, 3), slice(None), "H3"),
        ((1, 4), slice(None), "H3"),
        ((0, 5), slice(None), "H3"),
    ],
)
def test_steps_prove_the_symbol_of_their_own_interval(
    of: tuple[int, int], kept: slice, wanted: str, one: ProvenInterval
) -> None:
    assert (one.of, one.symbols) == (PhaseInterval(0, 4), [False])
    agree(wanted, *both(PhaseInterval(*of), one.pieces[kept]))


@pytest.mark.slow
def test_an_interval_a_percent_wider_is_not_proven_by_these_steps(
    one: ProvenInterval, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The same middle, and cosine and sine of an angle that is a percent larger.
    for module, of in ((intervals, "_turned"), (script, "turned")):
        turned: Any = getattr(module, of)
        wider: Any = lambda angle, turned=turned: turned(angle * 101 / 100)  # noqa: E731
        monkeypatch.setattr(module, of, wider)
    agree("H3", *both(one.of, one.pieces))


@pytest.mark.slow
def test_starts_drawn_at_random_have_the_symbols_in_113_bits(two: list[ProvenInterval]) -> None:
    proven = [each for each in two if each.symbols]
    assert {len(each.symbols) for each in proven} == {1, 2}
    with lot.drawn("interval") as chance:
        for each in proven:
            low, high = each.of.ends
            # The ends too.
            shares = [low, high, *(low + (high - low) * Fraction(chance.random()) for _ in "1234")]
            phases = [exact(f"2*pi*{x.numerator}/{x.denominator}") for x in shares]
            asked: Any = {"n_symbols": len(each.symbols), "precisions": (113,)}
            codes = route_codes(BODY, phases, h0="1.3342", J1_0="1e-8", **asked).codes
            assert (codes == np.array(each.symbols)[:, None]).all(), each.of


@pytest.mark.slow
def test_an_interval_on_which_the_symbol_changes_is_halved_and_never_proven(
    two: list[ProvenInterval],
) -> None:
    found = [(each.of.place, each.of.depth, each.symbols) for each in two]
    assert found == [(1, 5, [False, True]), (16, 6, []), (17, 6, [True])]


def test_cosine_and_sine_hold_those_of_the_ends() -> None:
    for depth in (0, 1, 4, 20):
        with ctx.workprec(160):
            angle = arb.pi() / 2**depth
            for found, expected in zip(
                intervals._turned(angle), (angle.cos(), angle.sin()), strict=True
            ):
                end = found.at("u", 1).range
                assert end.overlaps(expected)
                assert float(end.rad()) < 1e-40


def test_what_is_left_of_cosine_and_sine_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The series ends at a 256th, where a term in 160 bits shows what is left."""
    monkeypatch.setattr(intervals, "BITS", 8)
    with ctx.workprec(160):
        angle = arb(1) / 2
        whole = zip(intervals._turned(angle), (angle.cos(), angle.sin()), strict=True)
        assert all(found.at("u", 1).range.contains(exactly) for found, exactly in whole)


@pytest.mark.parametrize("rising", [True, False])
@pytest.mark.parametrize(
    ("factor", "reason"), [(1.01, ""), (0.99, "H5: Q is too near"), (-0.99, "H5: Q is too near")]
)
def test_H5_the_large_Q_beside_its_bound(rising: bool, factor: float, reason: str) -> None:
    """M3 = 0 rises where gamma1 = 1, and falls where gamma2 = 1."""
    starts, bound = EnclosedStarts.of(Body(A=BODY.A, r=BODY.r, mu=1), H0, J1), 1e-3
    values, told = [0.0] * 6, list[Any]()
    values[0 if rising else 1], values[3 if rising else 4] = factor * bound, 1.0
    mine = [Family.of(constant(x), BITS) for x in values]
    refused = said(lambda: told.extend(intervals._on_step(starts.numbers, mine, arb(bound))))
    assert refused.startswith(reason)
    assert set(told) == (set() if reason else {(rising, 1)})


SHARES = [
    ([(0, 1), (1, 1)], [[0, 1]], [Fraction(1)]),
    ([(0, 1), (2, 2)], [[0, 255], [1, 255]], [Fraction(1, 2), Fraction(1, 2)]),
    ([(0, 3), (1, 1)], [[255, 1], [255, 0]], [Fraction(1, 2), Fraction(1, 2)]),
    ([(0, 2), (1, 2)], [[0, 0], [1, 255]], [Fraction(1, 2), Fraction(1, 4)]),
]


@pytest.mark.parametrize(("places", "codes", "expected"), SHARES)
def test_shares_are_those_of_what_is_proven(
    places: list[tuple[int, int]], codes: list[list[int]], expected: list[Fraction]
) -> None:
    found = compute.shares_of(
        [PhaseInterval(*at) for at in places], np.array(codes, dtype=np.uint8)
    )
    assert found == expected


@pytest.mark.parametrize("places", [[(0, 1), (0, 2)], [(1, 1), (0, 1)], [(2, 1)], [(0, -1)]])
def test_intervals_that_overlap_or_are_none_are_refused(places: list[tuple[int, int]]) -> None:
    place, depth = (np.array(x) for x in zip(*places, strict=True))
    with pytest.raises(ValueError, match=r"overlap|none of the line"):
        compute.unpacked({"place": place, "depth": depth})


def test_more_bits_than_pairs_of_doubles_have_are_undecided() -> None:
    times = np.array([[100.0], [200.0]]) + np.zeros((2, interval_search.NODES))
    with pytest.raises(Undecided, match="bits"):
        interval_search.pieces(SETTING, J1, PhaseInterval(0, 10), times)


def test_a_crossing_that_comes_at_once_has_no_steps_before_it() -> None:
    once, later = (interval_search._halves(np.full((1, 20), x), 1.0) for x in (0.1, 2.0))
    assert (len(once), len(later)) == (2, 3)


FORGED = ("a hidden gap", "a larger share", "an overlap", "a symbol after a gap", "fewer intervals")


@pytest.mark.parametrize("how", FORGED)
def test_arrays_that_say_more_than_they_prove_are_refused(how: str, tmp_path: Path) -> None:
    file = tmp_path / "forged.h5"
    shutil.copy(REFERENCE / "fig4_intervals.h5", file)
    with h5py.File(file, "r+") as content:
        codes, place = content["data/intervals/codes"], content["data/intervals/place"]
        if how == "a hidden gap":
            codes[:, 0] = 255
        elif how == "a larger share":
            content["data/shares"][1] = content["data/shares"][0]
        elif how == "an overlap":
            place[1] = place[0]
        elif how == "a symbol after a gap":
            codes[0, 0] = 255
        else:
            kept = place[:-1]
            del content["data/intervals/place"]
            content["data/intervals/place"] = kept
        data = {
            "intervals": {name: x[()] for name, x in content["data/intervals"].items()},
            "shares": content["data/shares"][()],
            "proof": {name: x[()] for name, x in content["data/proof"].items()},
        }
    config: Any = loading.load(CONFIG).content
    with pytest.raises((Refused, Fails)):
        list(script.check(file))
    with pytest.raises(ArithmeticError, match="undecided"):
        compute.arranged(config.problem, data)


@pytest.mark.parametrize("name", ["intervals/depth", "proof/bits", "proof/coefficients"])
@pytest.mark.parametrize("how", ["more dimensions", "no whole numbers"])
def test_arrays_of_another_kind_are_refused(name: str, how: str, tmp_path: Path) -> None:
    file = tmp_path / "odd.h5"
    shutil.copy(REFERENCE / "fig4_intervals.h5", file)
    with h5py.File(file, "r+") as content:
        values = content["data"][name][()]
        del content["data"][name]
        content["data"][name] = values[..., None] if how == "more dimensions" else values + 0.5
    with pytest.raises(Refused, match="has another shape or kind"):
        list(script.check(file))


def test_a_body_of_two_moments_is_refused() -> None:
    with pytest.raises(Refused, match="A or r is not three numbers"):
        check_full_shift.problem_of({**GIVEN, "A": GIVEN["A"][:2]})


@pytest.mark.slow
def test_a_flipped_symbol_is_refused(one: ProvenInterval, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is stored is compared with what the second checker proves of it."""
    monkeypatch.setattr(script, "prove", lambda *_: [0])
    packed = {**pieces.packed([one.pieces])}
    packed["family"] = [int(k > 0) for k in packed["family"]]
    for claimed, told in (([0], False), ([1], True), ([0, 0], True)):
        assert bool(script.checked((GIVEN, 0, 4, claimed, packed))) is told


# ---- Files: checked whole from the command line, spoilt, and as the page tells of one.

PAGE = Path(__file__).parents[3] / "docs" / "full-shift.md"
SHORT = (
    *("--set", "problem.n_symbols=1", "--set", "problem.halvings=3"),
    # So long a way before the first crossing takes time alone.
    *("--set", "problem.J1_0=1/2", "--name", "short"),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a result of one symbol on intervals of 2 pi/8, half of which have it."""
    found = tmp_path_factory.mktemp("intervals")
    done = call(found, "run", "fig4_intervals", *SHORT, "--out", ".", "-j", "1")
    assert done.returncode == 0, done.stderr
    return found


KEPT = [
    (module, name, remembered(getattr(module, name)))
    for module, name in ((intervals, "symbols"), (script, "prove"))
]
"""Intervals that are the same in all files are proven once by each checker."""


@pytest.fixture
def once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compute, "cores", lambda: 1)
    monkeypatch.setattr(script, "ProcessPoolExecutor", Inline)
    for kept in KEPT:
        monkeypatch.setattr(*kept)


@pytest.mark.slow
@pytest.mark.usefixtures("once")
def test_a_whole_file_is_checked_again(folder: Path) -> None:
    [said] = certificates.check(folder / "short.h5", jobs=1, report=print)
    words = "1 symbol, the same on each interval, of all starts on 1/2 of the line"
    assert str(said).startswith(f"proven: {words}")
    [told] = script.check(folder / "short.h5")
    assert told.endswith("1 on 1/2, 0.5")


@pytest.mark.slow
@pytest.mark.usefixtures("once")
@pytest.mark.parametrize("how", ["a symbol", "a coefficient"])
def test_a_spoilt_file_is_not_proven(how: str, folder: Path) -> None:
    file = folder / "spoilt.h5"
    shutil.copy(folder / "short.h5", file)
    with h5py.File(file, "r+") as content:
        if how == "a symbol":
            codes = content["data/intervals/codes"]
            proven = int((codes[0] != 255).argmax())
            codes[0, proven] = 1 - codes[0, proven]
        else:
            # The first of Q+ of the first step.
            content["data/proof/coefficients"][0, 0] += 1 << 50
    with pytest.raises(store.StoreError, match="undecided"):
        certificates.check(file, jobs=1, report=print)
    with pytest.raises(Fails):
        list(script.check(file))


def test_the_page_tells_the_shares_of_the_reference() -> None:
    with h5py.File(REFERENCE / "fig4_intervals.h5") as content:
        shares = [Fraction(float(x)) for x in content["data/shares"]]
        count = len(content["data/intervals/place"])
    head = r"^\| `n_symbols` \| `halvings` .*\n.*\n"
    row = re.search(head + r"\| 2 \| 5 \|(.*)\|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert row
    told = [x.strip() for x in row[1].split("|")]
    assert [Fraction(x) for x in told[: len(shares)]] == shares
    assert told[3] == str(count)
