"""Single starts beside the intervals that they lie on."""

import functools
from contextlib import nullcontext
from fractions import Fraction
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.experiments.route_intervals import compute, draw
from rigidpend.experiments.route_intervals.compute import contradictions
from rigidpend.machine.files import StoreError
from rigidpend.numbers.exact import exact
from rigidpend.numbers.texts import NO_SYMBOL
from rigidpend.routes.certified import interval_search, intervals, proof_data
from rigidpend.routes.certified.horseshoe import ShiftProblem
from rigidpend.routes.certified.interval_search import ProvenInterval
from rigidpend.routes.certified.intervals import EnclosedStarts, PhaseInterval
from rigidpend.runs import certificates
from tests.cli.calls import REFERENCE
from tests.experiments.trees import asked, computed, differences, reference, shared_reference

# The quarters of the line: two symbols are proven on the first, one on the third.
INTERVALS = {
    "place": np.array([0, 2]),
    "depth": np.array([2, 2]),
    "codes": np.array([[0, 1], [1, NO_SYMBOL]], dtype=np.uint8),
}
CASES = [
    ("0.99", [1, 1, 0], False),
    ("0.99", [0], True),
    ("0.99", [0, 0, 1], False),
    ("1.01", [1, 1, 0], True),
    # Nearer to an end than doubles are to each other.
    ("1 - 1e-30", [1, 1, 0], False),
    ("1 + 1e-30", [1, 1, 0], True),
    ("1.99", [1], True),
    ("2.01", [1, 0, 0], True),
    ("2.01", [0], False),
    ("2.99", [0, 1, 0], False),
    ("3.01", [0, 0, 0], True),
]
"""In quarters of the line, a column's code, and whether it agrees with the intervals."""


@pytest.mark.parametrize(
    ("turns", "within", "code", "told"),
    [
        (0, "0", [0, 1, 1], True),
        (0, "0", [0, 0, 1], False),
        (0, "4.01", [1, 1, 1], False),
        (0, "-0.01", [1, 1, 1], True),
        *((n, *case) for n in (0, 10**9, 10**17, 10**30, -(10**30)) for case in CASES),
    ],
)
def test_a_column_has_the_symbols_of_the_interval_of_its_exact_phase(
    turns: int, within: str, code: list[int], told: bool
) -> None:
    """Beyond 1e15 rad the nearest double is further from a phase than an interval is long."""
    phases = [exact("3.1*pi/2"), exact(f"{turns}*2*pi + ({within})*pi/2")]
    columns = {
        "theta2_0": np.array([float(x) for x in phases]),
        "codes": np.array([[0, x] for x in code], dtype=np.uint8),
        "certain": np.ones((len(code), 2), dtype=bool),
    }
    wrong = [] if told else [float(phases[1])]
    assert contradictions(INTERVALS, phases, columns) == wrong
    # What is uncertain contradicts nothing.
    columns["certain"][:] = False
    assert contradictions(INTERVALS, phases, columns) == []


@functools.cache
def proven() -> list[ProvenInterval]:
    """What the reference proves of each of its intervals."""
    data = shared_reference("fig4_intervals")["data"]
    every = compute.unpacked(data["intervals"])
    steps = proof_data.unpacked(data["proof"], len(every))
    symbols = [[bool(x) for x in code if x != NO_SYMBOL] for code in data["intervals"]["codes"].T]
    return [ProvenInterval(*each) for each in zip(every, symbols, steps, strict=True)]


@pytest.fixture
def stored() -> Any:
    """The reference, its config, and what is proven of each of its intervals."""
    data, config = reference("fig4_intervals")["data"], asked("fig4_intervals")
    return SimpleNamespace(data=data, found=proven(), config=config)


@pytest.fixture(autouse=True)
def _here(monkeypatch: pytest.MonkeyPatch) -> None:
    """What processes would do is done in this one."""
    monkeypatch.setattr(
        compute, "side_by_side", lambda work, of, _, each, __: [work(x, *of) for x in each]
    )


def test_the_whole_line_is_searched_and_what_is_found_is_stored(
    stored: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, parts, jobs = stored.config.problem, list[str](), 3
    within = Mock(side_effect=lambda of, *_: [x for x in stored.found if x.interval == of])
    monkeypatch.setattr(interval_search, "proven_intervals", within)
    made = computed(stored.config, parts, jobs=jobs)
    setting = ShiftProblem(problem.body, problem.h0, 1, h0=problem.h0)
    given = setting, Fraction(1, 10**8), problem.n_symbols, problem.halvings
    expected = [(PhaseInterval(k, 5), *given) for k in range(32)]
    assert [call.args for call in within.call_args_list] == expected
    assert not differences("route_intervals", stored.data, made)
    assert made["columns"]["codes"].shape == (15, 63), "as Fig. 4's left array"
    # A part that fewer processes kept is another one.
    assert len(parts) == -(-32 // (compute.ROUND * jobs))
    assert {name.rpartition(".")[2] for name in parts} == {str(compute.ROUND * jobs)}


def test_intervals_of_which_nothing_is_proven_are_no_result(monkeypatch: Any) -> None:
    within = Mock(side_effect=lambda of, *_: [ProvenInterval(of, [], [])])
    monkeypatch.setattr(interval_search, "proven_intervals", within)
    with pytest.raises(ArithmeticError, match="no symbol is proven on any interval"):
        computed(asked("fig4_intervals", "problem.halvings=3"))
    tried = [call.args[0] for call in within.call_args_list]
    assert tried == [PhaseInterval(k, 3) for k in range(8)], "no shorter than they may be"


def test_an_interval_that_is_not_proven_again_is_in_no_theorem(
    stored: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each that has symbols is proven, by its own steps, in the problem of the config."""
    problem, known = stored.config.problem, {x.interval: x for x in stored.found if x.symbols}
    starts = EnclosedStarts.of(problem.body, problem.h0, Fraction(1, 10**8))
    symbols = Mock(side_effect=lambda _, interval, __: known[interval].symbols)
    monkeypatch.setattr(intervals, "symbols", symbols)
    shares = [sum(x.interval.share for x in stored.found if len(x.symbols) >= n) for n in (1, 2)]
    said = compute.theorems(stored.config, stored.data)
    assert said == [
        f"{n} symbol{'s' * (n > 1)}, the same on each interval, of all starts on {share} of the"
        f" line, {float(share):.6g}"
        for n, share in enumerate(shares, 1)
    ]
    calls = [call.args for call in symbols.call_args_list]
    assert all(of[1:] == starts[1:] for of, *_ in calls)
    steps = [(interval, list(pieces)) for _, interval, pieces in calls]
    assert sorted(steps) == sorted((of, list(x.pieces)) for of, x in known.items())
    # More than is stored may come out, and nothing else.
    one = next(x for x in stored.found if len(x.symbols) == 1)
    part = one.interval, one.pieces, [int(one.symbols[0]), NO_SYMBOL]
    monkeypatch.setattr(compute, "arranged", lambda *_: ([part], shares))
    for found, well in (([*one.symbols, True], True), ([not one.symbols[0]], False), ([], False)):
        symbols.side_effect = [found]
        with nullcontext() if well else pytest.raises(ArithmeticError, match="differ, or fewer"):
            compute.theorems(stored.config, stored.data)


def test_a_result_in_which_nothing_is_proven_is_no_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compute, "theorems", lambda *_: [])
    with pytest.raises(StoreError, match="nothing is proven: its proof has no theorem"):
        certificates.check(REFERENCE / "fig4_intervals.h5", jobs=1, report=print)


@pytest.mark.parametrize(
    ("spoilt", "said"),
    [
        (lambda data: data["codes"].fill(2), "a symbol is not 0 or 1"),
        (lambda data: data["codes"].__setitem__((0, 0), NO_SYMBOL), "follows one that is not"),
        (lambda data: data.update(codes=data["codes"][:1]), "asks for 2 symbols"),
        (lambda data: data["place"].__setitem__(-1, 32), "not on the line"),
        (lambda data: data["depth"].__setitem__(1, 4), "overlap"),
        (lambda data: data["place"].__setitem__(1, data["place"][0]), "overlap"),
    ],
)
def test_intervals_that_no_line_has_are_in_no_theorem(spoilt: Any, said: str, stored: Any) -> None:
    spoilt(stored.data["intervals"])
    with pytest.raises(ValueError, match=said):
        compute.arranged(stored.config.problem, stored.data)


def test_no_more_intervals_are_expected_than_symbols_ask_for() -> None:
    """The line is cut in 2^(2 n + 1) for n symbols at most; here n is 2."""
    costs = [compute.cost(asked("fig4_intervals", f"problem.halvings={k}")) for k in (3, 5, 9)]
    assert costs == [costs[1] / 4, costs[1], costs[1]]


def test_a_body_of_which_nothing_can_be_proven_is_refused_before_any_search() -> None:
    """Its bound grows so fast that pairs of doubles know too little, and the search finds none."""
    settings = ("A=[2, 1.7, 1.85]", "r=[2, 1, 0]", "mu=0.1", "h0=1")
    given = asked("fig4_intervals", *(f"problem.{each}" for each in settings))
    with pytest.raises(ArithmeticError, match="one symbol of this body takes some 177 bits"):
        computed(given, report=Mock(side_effect=AssertionError))
    problem = given.problem
    setting = ShiftProblem(problem.body, problem.h0, 1, h0=problem.h0)
    sought = setting, Fraction("1e-8"), 1, 5
    [found] = interval_search.proven_intervals(PhaseInterval(0, 5), *sought)
    assert found.symbols == []


def test_a_run_ends_with_an_error_where_a_column_is_another(monkeypatch: Any) -> None:
    data = reference("fig4_intervals")["data"]
    part = {"intervals": data["intervals"], "proof": data["proof"]}
    columns = {name: x.copy() for name, x in data["columns"].items()}
    monkeypatch.setattr(compute, "FIRST", 0)
    monkeypatch.setattr("rigidpend.routes.codes.codes_of", lambda *_: SimpleNamespace(**columns))
    given = asked("fig4_intervals")
    computed(given, pieces=lambda _: [part])
    columns["codes"][1, 30] ^= 1
    with pytest.raises(ArithmeticError, match=r"contradict those of theta2_0 = \[3\.0"):
        computed(given, pieces=lambda _: [part])


def test_a_blank_beside_the_codes_is_outside_of_their_frame() -> None:
    """Single starts end before 2 pi, where intervals do, and these begin behind the first start."""
    ends = []
    for axes in draw.draw(reference("fig4_intervals")).axes:
        [mesh] = axes.collections
        x = mesh.get_coordinates()[..., 0]  # type: ignore[attr-defined]
        ends.append((x.min(), x.max()))
        sides = [axes.spines[side].get_position() for side in ("left", "right")]
        assert sides == [("data", end) for end in ends[-1]]
        assert axes.spines["top"].get_bounds() == axes.spines["bottom"].get_bounds() == ends[-1]
    np.testing.assert_allclose(ends, [(-0.05, 6.25), (0, 2 * np.pi)])
