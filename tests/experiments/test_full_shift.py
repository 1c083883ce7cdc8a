"""The experiment `full_shift`: what it proves, what it says where it does not, and its report."""

import copy
import math
import re
from fractions import Fraction
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from flint import arb, ctx

from rigidpend.experiments.compare import differences
from rigidpend.experiments.contract import Means
from rigidpend.experiments.full_shift import LAYOUT, draw, proof
from rigidpend.experiments.full_shift import compute as full_shift
from rigidpend.numbers.exact import exact
from rigidpend.routes.certified import (
    chains,
    connections,
    coverings,
    family_orbits,
    horseshoe,
    passages,
    proof_data,
    sections,
    start_lines,
)
from rigidpend.routes.certified.proof_data import FamilyStep, Undecided
from tests.experiments.trees import asked, reference

SEARCHED = "problem.half_turns=null"
OTHER = [
    "problem.A=[2, 0.87, 1.84]",
    "problem.r=[0.36, 0.93, 0]",
    "problem.mu=5.1e-5",
    "problem.h=1",
    "problem.J1_0=1e-9",
    SEARCHED,
]
"""A body drawn at random, whose surfaces cross at an angle of 1.4e-6."""
OWN = ["problem.h=null", "problem.h0=1.3342"]
"""The starts of Fig. 4 themselves."""
ALONE = [FamilyStep(60, {(0, 0, 0): 2}, [{(0, 0, 0): 0}] * 6)]
"""A step that is none of any set."""


def passages_of(half_turns: int, *problem: str) -> tuple[Any, Any]:
    """The shipped problem, its keys set otherwise, and the setting of so many half rotations."""
    given = asked("full_shift", *(f"problem.{each}" for each in problem)).problem
    of = horseshoe.ShiftProblem(given.body, given.h, half_turns)
    [setting] = horseshoe.trials(of, half_turns)
    return given, setting


@pytest.fixture
def data() -> Any:
    """What is stored, as each test's own."""
    return reference("full_shift")["data"]


@pytest.fixture
def believed(monkeypatch: pytest.MonkeyPatch) -> dict[str, Mock]:
    """What asks for each further theorem, where all holds."""
    monkeypatch.setattr(coverings, "prove", lambda *_: ([], [["of a set"]]))
    monkeypatch.setattr(coverings, "prove_line", lambda *_: (None, ["of the line"], []))
    asks = {name: Mock() for name in ("prove_cones", "prove_connections", "prove_transversal")}
    for name, ask in asks.items():
        monkeypatch.setattr(coverings if name == "prove_cones" else connections, name, ask)
    return asks


@pytest.mark.slow
def test_sets_and_polynomials_are_found_as_they_are_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    """What these prove is asked of the stored ones, by both checkers."""

    offered = Mock(side_effect=InterruptedError)
    monkeypatch.setattr(full_shift, "checked", offered)
    with pytest.raises(InterruptedError):
        full_shift.compute(asked("full_shift"), Means())
    _, found = offered.call_args.args
    assert found.keys() == {"sets", "line", "proof"}
    layout, known = (
        {name: {key: each[name][key] for key in found[name]} for name in found}
        for each in (dict[str, Any](LAYOUT), reference("full_shift")["data"])
    )
    assert differences(layout, known, found) == []


@pytest.mark.slow
def test_smaller_angles_ask_for_more_bits_and_then_sets_are_tried_wider(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Bits by twice the logarithm of the distance from the surface, for some more than a word."""
    monkeypatch.setattr(horseshoe, "TRIALS", 1)
    # The settings of which polynomials are asked for, where none are found.
    found = Mock(side_effect=ArithmeticError)
    monkeypatch.setattr(family_orbits, "pieces", found)
    for changes in ([], OTHER, ["problem.lengths=2"]):
        with pytest.raises(ArithmeticError, match="nothing is proven"):
            full_shift.compute(asked("full_shift", *changes), Means())
    own, narrow, wide, finer, two = (setting for (setting, _), _ in found.call_args_list)
    assert (own.half_turns, own.bits) == (14, 60)
    assert narrow.half_turns > 14
    assert 62 < narrow.bits <= horseshoe.MOST_BITS
    words = [x.described.partition(" half")[2] for x in (narrow, wide, finer)]
    others = [" rotations, in wider sets", " rotations, with 6 more bits"]
    assert words == [" rotations", *others]
    assert finer == narrow._replace(bits=narrow.bits + 6, more=6)
    assert (narrow.width, wide.width) == (horseshoe.WIDTH, horseshoe.WIDER)
    assert two.lengths == 2


def test_the_reason_of_a_trial_is_told_before_the_next_one(monkeypatch: pytest.MonkeyPatch) -> None:
    given = asked("full_shift").problem
    settings = [horseshoe.ShiftProblem(given.body, given.h, n) for n in (14, 15)]
    monkeypatch.setattr(horseshoe, "trials", lambda *_: settings)
    monkeypatch.setattr(horseshoe, "quads", Mock(side_effect=ArithmeticError("lost")))
    told = list[str]()
    with pytest.raises(ArithmeticError, match="with 14 half rotations: lost; with 15 half"):
        full_shift.compute(asked("full_shift"), Means(report=told.append))
    words = ("sets are found, with passages of {} half", "undecided with {} half rotations: lost")
    expected = [text.format(n) for n in (14, 15) for text in words]
    assert [line[: len(text)] for line, text in zip(told, expected, strict=True)] == expected


@pytest.mark.slow
def test_the_first_sets_are_those_of_the_fewest_half_rotations_that_are_narrow_enough() -> None:
    """Of a body on which lines fitted to far too few half rotations say any number.

    With 37 of them sets would reach to a gamma3 of 670: that told to try 60 first.
    """
    problem = "A=[2, 1.57, 1.82]", "r=[0.18, 0.98, 0]", "mu=0.0042", "h=1", "half_turns=null"
    given = asked("full_shift", *(f"problem.{each}" for each in problem)).problem
    first = next(horseshoe.trials(horseshoe.ShiftProblem(given.body, given.h, 1)))
    fewer = horseshoe.quads(first._replace(half_turns=first.half_turns - 1))
    assert max(abs(quad.l0 / quad.l1) + quad.b / abs(quad.l1) for quad in fewer) > horseshoe.NARROW


@pytest.mark.slow
def test_sets_and_starts_of_many_half_rotations_are_followed_to_the_next_sets() -> None:
    """Fig. 5's body: 37 of them, in which a bound grows by 2^29, and of a line that is wide."""
    body = "A=[2, 1.5, 1.8]", "r=[0, 1, 0]", "mu=0.01", "h=10/9"
    given, setting = passages_of(37, *body)
    sets = horseshoe.quads(setting)
    numbers = sections.Numbers.of(given.body, given.h)
    found = passages.arrival(numbers, sets[0], family_orbits.pieces(setting, sets[0]))
    for k, other in enumerate(sets[2:], 2):
        relation = coverings.relation(found, other, found.box, k)
        assert relation.edge > 1 > relation.across
    starts, ends = start_lines.line(setting, Fraction(given.J1_0.fraction), sets)
    link = chains.Link(starts, setting, theta2=ends)
    assert chains.across(link, sets)[0] == link


@pytest.mark.slow
def test_a_strip_whose_orbits_do_not_cross_is_not_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method had sent some of them to times that took minutes, or any number of steps."""
    monkeypatch.setattr(family_orbits, "steps_of", Mock(side_effect=InterruptedError))
    body = "A=[2, 0.18, 1.94]", "r=[0.92, 0.38, 0]", "mu=0.00017", "h=1", "J1_0=9.7e-16"
    given, setting = passages_of(7, *body)
    action, sets = Fraction(given.J1_0.fraction), horseshoe.quads(setting)
    starts, ends = start_lines.line(setting, action, sets)
    with pytest.raises(ArithmeticError, match="do not cross next"):
        start_lines.line_pieces(setting, starts, ends)


@pytest.mark.slow
@pytest.mark.parametrize(("J1", "strip"), [("1e-14", True), ("1e-19", False)])
def test_lines_close_to_the_periodic_orbit_cross_the_sets(J1: str, strip: bool) -> None:
    """The closer they are, the longer a bound grows, and the more bits and nodes they have.

    A strip beside the closest ones has orbits that do not cross next, and is left out.
    """
    _, setting = passages_of(14)
    sets, action = horseshoe.quads(setting), Fraction(J1)
    starts, ends = start_lines.line(setting, action, sets)
    assert starts.wide > 0
    fine = start_lines.with_bits(setting, action, ends, sets)
    link, found = chains.across(chains.Link(starts, fine, theta2=ends), sets)
    assert link.start == (starts if strip else starts._replace(wide=Fraction(0)))
    _, (off, *_) = sections.beginning(setting.numbers, link.start, found[0])
    assert off < 2e-17
    end = passages.arrival(setting.numbers, link.start, found)
    for k, quad in enumerate(sets[:2]):
        relation = coverings.relation(end, quad, end.box, k)
        assert relation.edge > 50
        assert relation.across < 0.05
        assert relation.squeeze < 0.2
        assert relation.stretch > 50


BEGIN = "half rotations begin beside the heteroclinic orbits, as far as the return map tells"
NOT_SHOWN: list[tuple[Any, ...]] = [
    # Hess: one of the surfaces does not split.
    (["problem.r=[1, sqrt(2), 0]"], BEGIN),
    (["problem.r=[1, sqrt(2), 0]", SEARCHED], "surfaces of the periodic orbits cross at"),
    (["problem.mu=1e-12", SEARCHED], "the surfaces of the periodic orbits cross at an angle"),
    # An angle that is lost among roundings, and one of which sets would be too small.
    (["problem.mu=1e-8", SEARCHED], "of 1e-08 or less no sets are tried"),
    # So few half rotations that the sets are too large to be straight, or too many.
    (["problem.half_turns=11"], "sets are too wide"),
    (["problem.half_turns=32"], f"no passages of 32 {BEGIN}: try fewer"),
    (["problem.half_turns=2"], f"no passages of 2 {BEGIN}: try more"),
    # Polynomials that the checker does not believe: its reason is said with the set.
    (
        ["problem.half_turns=14"],
        "with 14 half rotations: set 0: C1: ",
        (family_orbits, "pieces", lambda *_: ALONE),
        (chains, "line_pieces", lambda *_: ALONE),
    ),
    # Both edges of a set are the same where images reach no further than its middle.
    (["problem.half_turns=14"], "lost in rounding", (horseshoe, "OVERSHOOT", 0.0)),
]


@pytest.mark.slow
@pytest.mark.parametrize("case", NOT_SHOWN)
def test_what_is_not_shown_is_undecided(
    case: tuple[Any, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    changes, said, *patches = case
    for patch in patches:
        monkeypatch.setattr(*patch)
    with pytest.raises(ArithmeticError, match="undecided, nothing is proven") as failed:
        full_shift.compute(asked("full_shift", *changes), Means())
    assert said in str(failed.value)


@pytest.mark.parametrize(
    ("lacking", "around", "doubts"),
    [
        ("", "1e-6", [False, False, False]),
        ("prove_cones", "0", [True, False, True]),
        ("prove_connections", "0", [False, True, True]),
        ("prove_transversal", "0", [False, False, True]),
    ],
)
def test_the_last_theorem_needs_what_those_before_it_need_and_a_smaller_interval_may_help(
    data: Any,
    believed: dict[str, Mock],
    monkeypatch: pytest.MonkeyPatch,
    lacking: str,
    around: str,
    doubts: list[bool],
) -> None:
    if lacking:
        believed[lacking].side_effect = Undecided("not shown")
    # What is stored is of one energy.
    monkeypatch.setattr(proof, "spread_of", lambda *_: 0)
    proven = proof.checked(asked("full_shift", f"problem.around={around}"), data)
    assert list(map(bool, proven.doubts)) == doubts
    remedy = "a smaller around" if float(around) else "a larger mu/h"
    assert believed["prove_cones"].call_args.args[1] == remedy


@pytest.mark.parametrize("approached", [False, True])
def test_behind_an_approach_phases_are_told_and_no_numbers_of_starts(
    data: Any, believed: dict[str, Mock], approached: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There may be several starts of one code: of the crossed sets no cones are asked."""
    monkeypatch.setattr(proof_data, "unpacked", lambda _, n: [[None]] * n)
    monkeypatch.setattr(sections, "phases", lambda *_: (1.0, 2.0))
    before = {"approach": data["sets"]} if approached else {}
    found = proof.checked(asked("full_shift"), data | before)
    asked_of = believed["prove_cones"].call_args.args[0]
    assert asked_of == ["of a set", *([] if approached else ["of the line"])]
    assert found.theta2 == (1.0, 2.0)
    # Of the image of the approach's last set, which is none of a strip of starts, C9 is not asked.
    assert found.doubts == ("", "", "C9: the starts come to the sets by an approach" * approached)


@pytest.mark.parametrize(
    ("energies", "words"),
    [
        ({"h": exact("1.3342"), "h0": None}, "energy that differs from h by at most 0.25"),
        ({"h": None, "h0": exact("1.3342")}, "from h0 + 0.5 by at most 0.25, but the starts are"),
    ],
)
def test_a_theorem_names_the_energies_for_which_it_holds(
    energies: dict[str, Any], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing: Any = None
    proven = proof.Proven([], [], nothing, [], [], (1.0, 2.0), ("", "", ""))
    monkeypatch.setattr(full_shift, "checked", lambda *_: proven)
    monkeypatch.setattr(full_shift, "margins", lambda _: {})
    config = asked("full_shift")
    config = config.model_copy(update={"problem": config.problem.model_copy(update=energies)})
    line = {"theta2": np.array([1.25, 1.75])}
    data = {"line": line, "energies": {"shift": 0.5, "spread": 0.25}}
    *_, last = full_shift.theorems(config, data)
    assert words in last


def test_what_tables_show_is_what_the_proof_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    """The proof uses no symbols and margins, but tables and figures show them."""
    arrivals: Any = [
        Mock(right=right, bound=1e-9, late=1e-9, duration=(5.0, 6.0)) for right in (True, False)
    ]
    start: Any = Mock(bound=1e-9)
    crossed = coverings.Relation(0, 1, 168.0, 0.01, 253.0, 0.03)
    proven = proof.Proven(arrivals, [[crossed]], start, [crossed], [1], (1.0, 2.0), ("", "", ""))
    monkeypatch.setattr(full_shift, "checked", lambda *_: proven)
    config, data = asked("full_shift"), full_shift.margins(proven)
    data["line"]["theta2"] = np.array([1.0, 2.0])
    said = full_shift.theorems(config, data)
    assert said[0].startswith("1 covering relations hold")
    after = "crosses the sets after the symbols 1: every one-sided sequence is a start's code"
    assert said[1].endswith(f"{after} behind these")
    assert data["sets"]["symbol"].tolist() == [1, 0]
    for ends in ([0.999, 2.0], [1.0, 2.001], [1.8, 1.2]):
        beyond = data | {"line": data["line"] | {"theta2": np.array(ends)}}
        with pytest.raises(ArithmeticError, match="line/theta2 is not within"):
            full_shift.theorems(config, beyond)
    for group, name in [(group, name) for group, fields in data.items() for name in fields]:
        wrong = copy.deepcopy(data)
        # The least change of a symbol, or of a number beyond what is rounding.
        wrong[group][name] = np.where(wrong[group][name] == 0, 1, wrong[group][name] * (1 + 2e-4))
        with pytest.raises(ArithmeticError, match=f"{group}/{name} is not"):
            full_shift.theorems(config, wrong)


@pytest.mark.slow
@pytest.mark.usefixtures("believed")
def test_symbols_of_an_approach_are_those_that_the_config_asks_for(data: Any) -> None:
    """The stored line has none, and an address that no orbit has is undecided."""
    config = asked("full_shift")
    problem = config.problem.model_copy(update={"approach": "0^15"})
    config = config.model_copy(update={"problem": problem})
    with pytest.raises(ArithmeticError, match="symbols of the approach differ"):
        full_shift.theorems(config, data)
    with pytest.raises(ArithmeticError, match="there is no approach"):
        full_shift.compute(asked("full_shift", *OWN, "problem.approach=a 0^3"), Means())


def test_bounds_are_rounded_outward() -> None:
    result = reference("full_shift")
    [relations, sets] = draw.tables(result)
    assert len(relations.rows) == 8
    # No bounds: what is proven of the phases is wider.
    assert "theta2_0 from about 1.55672 to 1.56834, crosses" in relations.note
    proven = result["data"]["relations"]
    told = np.array([[float(x.split()[-1]) for x in row[2:6]] for row in relations.rows]).T
    for k, name in ((0, "edge"), (2, "stretch")):
        assert (told[k] <= proven[name].flat).all()
        assert (told[k] > (1 - 1e-3) * proven[name].ravel()).all()
    for k, name in ((1, "across"), (3, "squeeze")):
        assert (told[k] >= proven[name].flat).all()
        assert (told[k] < proven[name].ravel() + 1e-4).all()
    proven = result["data"]["sets"]
    low, high = np.array([[float(x) for x in row[3].split(" to ")] for row in sets.rows]).T
    for off in (proven["shortest"] - low, high - proven["longest"]):
        assert 0 <= off.min() <= off.max() < 1e-4
    share = [float(row[2]) for row in sets.rows] / proven["bound"]
    assert 1 <= share.min() <= share.max() < 1.1
    assert "at least ln(4)/2 a passage" in sets.note
    stated = float(sets.note.split()[-5])
    times = proven["longest"].reshape(2, 2)
    assert np.exp(-stated * times).sum(axis=1).prod() > 1
    assert np.exp(-(stated + 1e-5) * times).sum(axis=1).prod() < 1


def test_the_entropy_is_what_the_sum_of_exponentials_allows() -> None:
    """Held against another library: in doubles roundings of the sum would decide."""
    lot, rising = np.random.default_rng(1), np.arange(6) % 3 > 0
    for times in lot.uniform(20, 30, (20, 6)):
        found = draw.entropy({"longest": times, "rising": rising})
        for s, more in ((found, True), (math.nextafter(found, 1), False)):
            with ctx.workprec(200):
                weights = np.array([(-arb(s) * arb(time)).exp() for time in times])
                assert bool(weights[rising].sum() * weights[~rising].sum() > 1) is more


def test_images_are_drawn_upon_the_sets_that_they_cross() -> None:
    for axes in draw.draw(reference("full_shift")).axes:
        drawn = [(patch.get_alpha() is not None, patch.get_zorder()) for patch in axes.patches]
        sets = [order for pale, order in drawn[:4] if not pale]
        images = [order for pale, order in drawn[:4] if pale]
        assert len(sets) == len(images) == 2
        assert max(sets) < min(images)


def test_a_large_factor_is_told_in_three_digits() -> None:
    result = reference("full_shift")
    d = result["data"]["drawn"]["d"]
    middle = d.mean(axis=1, keepdims=True)
    d[:] = middle + (d - middle) / 1234
    [*_, one, other] = [axes.get_title("left") for axes in draw.draw(result).axes]
    for title in one, other:
        [digits] = re.findall(r"of these, ([1-9][\d,]{4,}) times higher", title)
        assert len(digits.replace(",", "").rstrip("0")) <= 3


@pytest.mark.parametrize(
    ("more", "said"),
    [({}, "starts on a line"), ({"approach": {}}, "middle of the approach's image")],
)
def test_a_line_behind_an_approach_is_not_said_to_be_that_of_starts(
    more: dict[str, Any], said: str
) -> None:
    result = reference("full_shift")
    [legend] = draw.draw({**result, "data": {**result["data"], **more}}).legends
    assert legend.get_texts()[-1].get_text() == said
