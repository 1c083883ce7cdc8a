"""Symbols of whole intervals of starts: proven by both checkers, against 113 bits, and spoilt."""

import itertools
import math
import re
import shutil
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import h5py
import numpy as np
import pytest
from flint import arb, ctx

from rigidpend import Body, route_codes
from rigidpend.numbers.exact import exact
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map.expansions import nodes
from rigidpend.results import store
from rigidpend.routes.certified import interval_search, intervals, proof_data
from rigidpend.routes.certified.horseshoe import ShiftProblem
from rigidpend.routes.certified.interval_search import ProvenInterval, proven_intervals
from rigidpend.routes.certified.intervals import EnclosedStarts, PhaseInterval
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.proof_data import Undecided
from scripts import check_intervals as script
from scripts import check_proof_data
from scripts.check_certificate import Fails, Interval, Refused
from tests.attacks import lot
from tests.cli.calls import REFERENCE
from tests.remembered import inline
from tests.routes.certified import offered
from tests.routes.certified.offered import BODY, H0, J1, agree, constant, duration, said, step
from tests.runs.checkers import config_of, restated

GIVEN = offered.Start()._asdict()
ROOT = Path(__file__).parents[3]
CONFIG, PAGE = ROOT / "configs" / "fig4_intervals.yaml", ROOT / "docs" / "full-shift.md"
SETTING, STARTS = ShiftProblem(BODY, H0, 1, h0=H0), EnclosedStarts.of(BODY, H0, J1)
ONE, TWO = (SETTING, J1, 1, 4), (SETTING, J1, 2, 6)


@pytest.fixture(scope="module")
def one() -> ProvenInterval:
    """One symbol of the starts from 0 to pi/8."""
    [found] = proven_intervals(PhaseInterval(0, 4), *ONE)
    return found


@pytest.fixture(scope="module")
def two() -> list[ProvenInterval]:
    """Two symbols, and one beside a place where the first one changes."""
    return [x for k in (1, 8) for x in proven_intervals(PhaseInterval(k, 5), *TWO)]


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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("of", "kept", "wanted"),
    [
        ((0, 4), slice(-1), "H4"),
        ((0, 4), slice(1, None), "H3"),
        ((0, 3), slice(None), "H3"),
        ((1, 4), slice(None), "H3"),
        ((0, 5), slice(None), "H3"),
    ],
)
def test_steps_prove_the_symbol_of_their_own_interval_alone(
    of: tuple[int, int], kept: slice, wanted: str, one: ProvenInterval
) -> None:
    steps, again = one.pieces[kept], [step(x) for x in one.pieces[kept]]
    agree(
        wanted,
        lambda: intervals.symbols(EnclosedStarts.of(BODY, H0, J1), PhaseInterval(*of), steps),
        lambda: script.prove(GIVEN, *of, again),
    )


@pytest.mark.slow
def test_starts_drawn_at_random_have_the_symbols_in_113_bits(two: list[ProvenInterval]) -> None:
    proven = [each for each in two if each.symbols]
    assert {len(each.symbols) for each in proven} == {1, 2}
    with lot.drawn("interval") as chance:
        for each in proven:
            low, high = each.interval.ends
            # The ends too.
            shares = [low, high, *(low + (high - low) * Fraction(chance.random()) for _ in "1234")]
            phases = [exact(f"2*pi*{x.numerator}/{x.denominator}") for x in shares]
            asked: Any = {"n_symbols": len(each.symbols), "precisions": (113,)}
            codes = route_codes(BODY, phases, h0="1.3342", J1_0="1e-8", **asked).codes
            assert (codes == np.array(each.symbols)[:, None]).all(), each.interval


@pytest.mark.slow
def test_an_interval_with_a_change_is_halved_and_never_proven(two: list[ProvenInterval]) -> None:
    found = [(each.interval.place, each.interval.depth, each.symbols) for each in two]
    assert found == [(1, 5, [False, True]), (16, 6, []), (17, 6, [True])]


@pytest.mark.parametrize("share", [1, 1 / 16, 2.0**-20])
def test_cosine_and_sine_hold_those_of_the_end(share: float) -> None:
    with ctx.workprec(160):
        angle = arb.pi() * share
        for found, exactly in zip(intervals.turned(angle), (angle.cos(), angle.sin()), strict=True):
            end = found.at("u", 1).range
            assert end.contains(exactly)
            assert float(end.rad()) < 1e-40


def test_what_is_left_of_cosine_and_sine_is_in_their_errors(monkeypatch: Any) -> None:
    """After 6 and 7 terms, in both checkers: the rest is far more than a rounding."""
    angle, end = 0.5, (math.cos(0.5), math.sin(0.5))
    for terms in (6, 7):
        for module in (intervals, script):
            monkeypatch.setattr(module, "TERMS", terms)
        mine = [each.at("u", 1).range for each in intervals.turned(arb(angle))]
        theirs = [each.at(1, 1).ball() for each in script.turned(Interval.of(Fraction(angle)))]
        for ball, other, exactly in zip(mine, theirs, end, strict=True):
            assert ball.contains(exactly)
            assert other.low <= Interval.of(Fraction(exactly)).low <= other.high
            assert float(ball.rad()) < 3 * angle**terms / math.factorial(terms)


@pytest.mark.parametrize("rising", [True, False])
@pytest.mark.parametrize(
    ("factor", "reason"), [(1.01, ""), (0.99, "H5: Q is too near"), (-0.99, "H5: Q is too near")]
)
def test_H5_the_large_Q_beside_its_bound(rising: bool, factor: float, reason: str) -> None:
    """M3 = 0 rises where gamma1 = 1, and falls where gamma2 = 1."""
    starts, bound = EnclosedStarts.of(Body(A=BODY.A, r=BODY.r, mu=1), H0, J1), 1e-3
    values, told = [0.0] * 6, list[Any]()
    values[0 if rising else 1], values[3 if rising else 4] = factor * bound, 1.0
    mine = [Family.of(constant(x), offered.BITS) for x in values]
    refused = said(lambda: told.extend(intervals.signs_on_step(starts.numbers, mine, arb(bound))))
    assert refused.startswith(reason)
    assert set(told) == (set() if reason else {(rising, 1)})


def steps_of(times: Any) -> Any:
    """Steps up to crossings at these times, from the starts of an interval."""
    return interval_search.pieces(SETTING, STARTS, PhaseInterval(0, 10), times)


def test_steps_end_as_long_behind_a_crossing_wherever_an_orbit_starts() -> None:
    """None is before a crossing that comes at once, and none in more bits than pairs have."""
    for time, count in ((0.1, 2), (2.0, 3)):
        assert len(steps_of(np.full((1, interval_search.NODES), time))) == count
    with pytest.raises(Undecided, match="bits"):
        steps_of(np.array([[100.0], [200.0]]) + np.zeros((2, interval_search.NODES)))
    u = nodes(interval_search.NODES, precision(53))
    steps = steps_of(times := np.stack([2 + u / 4, 5 - u / 2]))
    # A constant of half-lengths is stored exactly, and their slope is far above what is left out.
    ends = [duration(steps, at) for at in u]
    assert ends - times[-1] == pytest.approx(ends[0] - times[-1, 0], abs=1e-6)


@pytest.mark.parametrize(("place", "code"), [(7, [True]), (25, [False])])
def test_a_heavier_body_with_faster_rotations_has_proven_symbols_too(
    place: int, code: list[bool]
) -> None:
    """That of Fig. 5: orbits part faster than Lambda tells, and steps of few e turn often."""
    body, h0 = Body(A=(2, "1.5", "1.8"), r=(0, 1, 0), mu="0.01"), exact("10/9")
    setting = ShiftProblem(body, h0, 1, h0=h0)
    [found] = proven_intervals(PhaseInterval(place, 5), setting, J1, 1, 5)
    assert found.symbols == code


@pytest.mark.slow
@pytest.mark.parametrize("times", [Fraction(1, 1024), Fraction(512)])
def test_the_same_is_proven_in_other_units(times: Fraction, one: ProvenInterval) -> None:
    """Momenta are so many times as large, energies by its square, and t' as much smaller."""
    body, h = Body(BODY.A, BODY.r, BODY.mu * times**2), H0 * times**2
    given = ShiftProblem(body, h, 1, h0=h), J1 * times, 1, 4
    [found] = proven_intervals(PhaseInterval(0, 4), *given)
    assert found.symbols == one.symbols
    # Not by more steps: each is as long, counted in the unit of time.
    assert len(found.pieces) == len(one.pieces)


@pytest.mark.slow
def test_what_is_claimed_of_an_interval_is_what_is_proven_of_it(
    one: ProvenInterval, monkeypatch: pytest.MonkeyPatch
) -> None:
    proof = proof_data.packed([one.pieces])
    assert script.checked((GIVEN, 0, 4, [0], proof)) == ""
    monkeypatch.setattr(script, "prove", lambda *_: [0])
    assert script.checked((GIVEN, 0, 4, [1], proof))
    assert script.checked((GIVEN, 0, 4, [0, 0], proof))


# ---- Files, as the second checker reads them.


def changed(name: str, at: Any, value: Any) -> Callable[[Any], None]:
    return lambda data: data[name].__setitem__(at, value(data[name][()]))


def other(name: str, value: Callable[[Any], Any]) -> Callable[[Any], None]:
    """An array of another shape or kind."""

    def change(data: Any) -> None:
        values = value(data[name][()])
        del data[name]
        data[name] = values

    return change


def asked(symbols: Any, stored: int = 2) -> Callable[[Any], None]:
    """A config that asks for so many symbols, and as many rows of them; no share is claimed."""

    def change(data: Any) -> None:
        config = config_of(data.parent)
        config["problem"]["n_symbols"] = symbols
        restated(data.parent, config)
        other("shares", lambda x: x[:0])(data)
        other("intervals/codes", lambda x: x[[0] * stored])(data)

    return change


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        *((asked(n), "symbols are not as many") for n in (0, -1, 2.5, math.inf, None)),
        *((asked(n, n), "symbols are not as many") for n in (0, script.SYMBOLS + 1)),
        (changed("intervals/codes", (..., 0), lambda _: 255), "shares"),
        (changed("shares", 1, lambda x: x[0]), "shares"),
        (changed("intervals/place", 1, lambda x: x[0]), "overlap"),
        (changed("intervals/place", 0, lambda _: 32), "none of the line"),
        (changed("intervals/codes", (0, 0), lambda _: 255), "follows one that is not proven"),
        (other("intervals/place", lambda x: x[:-1]), "not as many as they say"),
        (other("intervals/codes", lambda x: x[:, :-1]), "of other intervals than are stored"),
        *(
            (other(name, how), "has another shape or kind")
            for name in ("intervals/depth", "proof/bits", "proof/coefficients")
            for how in (lambda x: x[..., None], lambda x: x + 0.5)
        ),
    ],
)
def test_arrays_that_say_more_than_they_prove_are_refused(
    change: Callable[[Any], None], reason: str, tmp_path: Path
) -> None:
    file = tmp_path / "forged.h5"
    shutil.copy(REFERENCE / "fig4_intervals.h5", file)
    with h5py.File(file, "r+") as content:
        change(content["data"])
    with pytest.raises(Refused, match=reason):
        list(script.check(file))


@pytest.mark.slow
def test_each_interval_is_asked_and_the_page_tells_shares(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that have symbols, each with its own steps; one that is not proven is named."""
    every = Mock(return_value="")
    monkeypatch.setattr(script, "ProcessPoolExecutor", inline)
    monkeypatch.setattr(script, "checked", every)
    file = REFERENCE / "fig4_intervals.h5"
    [told] = script.check(file, CONFIG)
    row = re.search(r"\n\| 2 \| 5 \|(.*?)\|(.*?)\|.*?\| *(\d+) *\|", PAGE.read_text("utf-8"))
    assert row
    shares = [Fraction(x) for x in row.groups()[:2]]
    each = "; ".join(f"{n} on {x}, {float(x):.6g}" for n, x in enumerate(shares, 1))
    assert told.endswith(f"of the line: {each}")
    data = store.load(file)["data"]
    place, depth, codes = (data["intervals"][name] for name in ("place", "depth", "codes"))
    assert int(row[3]) == len(place)
    steps = proof_data.unpacked(data["proof"], len(place))
    proven = [k for k in range(len(place)) if codes[0, k] != 255]
    for call, k in zip(every.mock_calls, proven, strict=True):
        _, *of, symbols, proof = call.args[0]
        assert (of, symbols) == ([place[k], depth[k]], [x for x in codes[:, k] if x != 255])
        assert len(check_proof_data.steps_of_sets(proof, 1)[0]) == len(steps[k])
    monkeypatch.setattr(script, "each", lambda *_: itertools.repeat({}))
    monkeypatch.setattr(script, "checked", lambda part: "H3" if part[1] == place[-1] else "")
    with pytest.raises(Fails, match=f"the interval {place[-1]}/2\\^{depth[-1]}: H3"):
        list(script.check(file))
