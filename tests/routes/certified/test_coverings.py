"""Covering relations: each hypothesis barely true and barely false, for both checkers.

Where a limit lies is computed here, in doubles, from docs/full-shift.md.
"""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import h5py
import numpy as np
import pytest
from flint import arb

from rigidpend.experiments.full_shift import compute as full_shift
from rigidpend.experiments.full_shift.schema import Config
from rigidpend.results import store
from rigidpend.routes.certified import connections, coverings, passages, sections
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.pieces import (
    MOST_DEGREE,
    FamilyStep,
    Quad,
    made,
    packed,
    unpacked,
    unpacked_energies,
    unpacked_quads,
)
from rigidpend.routes.symbolic.address import parsed
from rigidpend.runs import certificates
from scripts import check_full_shift as script
from scripts.check_certificate import Fails, Interval, Refused
from tests.config.samples import content as typed
from tests.routes.certified.offered import (
    BARELY,
    BITS,
    CONFIG,
    GIVEN,
    J1,
    STORED,
    Stored,
    agree,
    arrived,
    interval,
    problem,
    quad_of,
    said,
    series,
    step,
    whole,
)

ALONE, WIDEST = 2.0**-5, 2.0**-12
AT_ORBITS = Fraction(1), "C3", script.WIDEST


# ---- C6


def image(ends: float, across: float, quad: Quad) -> list[dict[Any, int]]:
    """d and g of an image that lies across a set: U = ends u, V = across v, on a straight set."""
    a, b, l0, l1 = (float(x) for x in quad[1:5])
    g = {(0, 1, 0): 2 * a * ends / l1, (0, 0, 1): -2 * b * across / l1, (0, 0, 0): -2 * l0 / l1}
    return [whole({(0, 1, 0): 2 * a * ends}), whole(g)]


STRAIGHT = made(True, (0.25, 0.5, 0.125, -0.5), (0.0,))


def across_straight(ends: float, across: float, sheet: float) -> list[Any]:
    """C6 of an image that lies so, by both."""
    box, begin = [arb(1 + sheet * ALONE), arb(0.5), arb(0.5)], [arb(1), arb(0.5), arb(0.5)]
    source, other = arrived(image(ends, across, STRAIGHT), box)
    return [
        lambda: coverings.relation(source, STRAIGHT, begin, 0),
        lambda: script.check_relation(other, quad_of(STRAIGHT), list(map(interval, begin))),
    ]


@pytest.mark.parametrize(
    ("ends", "across", "sheet", "reason"),
    [
        (1 + BARELY, 1 - BARELY, 1 - BARELY, ""),
        (-1 - BARELY, 1 - BARELY, 1 - BARELY, ""),
        (1 - BARELY, 1 - BARELY, 1 - BARELY, "C6: an edge"),
        (1 + BARELY, 1 + BARELY, 1 - BARELY, "C6: the image"),
        (1 + BARELY, 1 - BARELY, 1 + BARELY, "C6: the crossings"),
    ],
)
def test_C6_an_image_lies_across_a_set(
    ends: float, across: float, sheet: float, reason: str
) -> None:
    checks = across_straight(ends, across, sheet)
    agree(reason, *checks)
    if not reason:
        found = checks[0]()
        assert found.orientation == math.copysign(1, ends)
        np.testing.assert_allclose((found.edge, found.across), (abs(ends), across), rtol=1e-12)


# ---- C7


CONES = [
    ((1.51, 0.5, 0.0), (0.5, 0.49, 0.0), 0.0, ""),
    ((-1.51, 0.5, 0.0), (-0.5, -0.49, 0.0), 0.0, ""),
    ((1.49, 0.5, 0.0), (0.5, 0.49, 0.0), 0.0, "C7"),
    ((-1.49, 0.5, 0.0), (0.5, 0.49, 0.0), 0.0, "C7"),
    ((1.51, -0.53, 0.0), (0.5, 0.49, 0.0), 0.0, "C7"),
    ((1.51, 0.5, 0.0), (0.5, 0.51, 0.0), 0.0, "C7"),
    ((1.51, 0.5, 0.0), (0.5, -0.51, 0.0), 0.0, "C7"),
]
OF_ENERGIES = [
    ((2.5, 0.4, 69.6), (0.2, 0.3, 31.36), 0.0, ""),
    ((2.5, 0.4, 71.2), (0.2, 0.3, 31.36), 0.0, "C7"),
    ((2.5, 0.4, 69.6), (0.2, 0.3, 32.64), 0.0, "C7"),
    ((2.5, 0.4, 0.0), (0.2, 0.3, 0.0), 0.017, ""),
    ((2.5, 0.4, 0.0), (0.2, 0.3, 0.0), -0.01735, "C7"),
]


@pytest.mark.parametrize(
    ("U", "V", "w_u", "reason", "curve"),
    [(*x, curve) for curve in ((0.0,), (0.0, 0.25, -2.0)) for x in CONES]
    + [(*x, (0.0,)) for x in OF_ENERGIES],
)
def test_C7_differences_grow_along_u_or_shrink_along_v(
    U: Any, V: Any, w_u: float, reason: str, curve: tuple[float, ...]
) -> None:
    """U = U_u u + U_v v + U_w w and V alike, of a set that moves; w may change with u."""
    quad = made(True, (2.0**-10, 2.0**-9, 0.0, -0.5), curve)._replace(moves=((Fraction(1, 4),),))
    a, b, _, l1 = (float(x) for x in quad[1:5])
    of_d, level = [a * x for x in U], (w_u, 0.0, 1.0)
    of_g = [(a * x - b * y) / l1 for x, y in zip(U, V, strict=True)]
    axes = (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)
    rows = [
        whole({at: 2 * x for at, x in zip(axes, row, strict=True)}) for row in (of_d, of_g, level)
    ]
    # d = p(g) + w/4 + a U, whole in u, v and w.
    off, up, w = (Family.of(row, BITS) for row in rows)
    at = sections.moved([quad.p, *quad.moves], up, w) + off
    slopes = [[each.partial(name) for name in "uvw"] for each in (at, up, w)]
    there = arb(1), arb(1), arb(1)
    of = passages.Reached(at, up, True, there, 0.0, 0.0, (1.0, 1.0), [], slopes[:2], w, slopes[2])
    stretch, squeeze = coverings._cone(of, quad)
    assert stretch == pytest.approx(abs(U[0]) - abs(U[1]) - U[2] / 64 - 64 * abs(w_u), abs=1e-9)
    assert squeeze == pytest.approx(abs(V[0]) + abs(V[1]) + V[2] / 64, abs=1e-9)
    off_, up_, w_ = (series(row, BITS) for row in rows)
    at_ = quad_of(quad).curve(up_, w_) + off_
    along = [tuple(each.along(i) for each in (at_, up_, w_)) for i in script.ALONG]
    other = script.Arrival(at_, up_, 1, [], [], Interval.of(0), along, w_)
    one = coverings.Relation(0, 1, 2.0, 0.5, stretch, squeeze)
    agree(
        reason,
        lambda: coverings.prove_cones([one]),
        lambda: script.check_cone(other, quad_of(quad)),
    )


@pytest.fixture
def followed(stored: Stored, monkeypatch: pytest.MonkeyPatch) -> None:
    """The orbits of the stored sets and line are followed once, for all tests."""
    monkeypatch.setattr(coverings, "arrival", stored.followed(stored.arrivals))
    monkeypatch.setattr(script, "arrival", stored.followed(stored.theirs))


@pytest.mark.slow
def test_cones_and_the_middle_are_asked_of_all(
    stored: Stored, followed: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Eight relations of the sets and two of the line, by both: one that fails is enough."""
    config, data = typed(Config, CONFIG, []), stored.data
    monkeypatch.setattr(connections, "prove_transversal", lambda *_: None)
    monkeypatch.setattr(script, "check_transversal", lambda *_: None)
    middle: list[float] = []
    monkeypatch.setattr(script, "check_middle", lambda _, small: middle.append(float(small)))
    monkeypatch.setattr(connections, "check_middle", lambda _, x: middle.append(float(x.upper())))
    given = script.read(STORED)
    of_script = GIVEN, given.quads, script.Line(J1, *given.line), given.orbits
    # The first and the last of the sets, and those of the line.
    for bad in (0, 7, 8, 9):
        cones = [((1.0 if k == bad else 2.0), 0.5) for k in range(10)]
        monkeypatch.setattr(coverings, "_cone", Mock(side_effect=cones))
        cone = Mock(side_effect=[Fails("C7") if k == bad else None for k in range(10)])
        monkeypatch.setattr(script, "check_cone", cone)
        found = full_shift.checked(config, data).doubts
        theirs = script.prove(*of_script).doubts
        # What else Theorem 8 needs is named in its place.
        assert [found[0][:2], found[2], found[1]] == ["C7", found[0], ""]
        assert [theirs[0][-2:], theirs[2], theirs[1]] == ["C7", theirs[0], ""]
        # Each of another passage or to another set.
        assert (
            len({(id(x), y.rising, y.a) for x, y in (z.args for z in cone.mock_calls)}) == bad + 1
        )
    # C8 is asked of the largest |d| of all sets and images.
    drawn, curves = data["drawn"], [[float(x) for x in quad.p] for quad in stored.quads]
    surface = [
        np.polynomial.polynomial.polyval(-np.sin(drawn["chi"][k]), curves[k]) for k in (0, 2)
    ]
    # Both add their bounds on the distance and on the time of the crossing, 1e-7.
    assert middle[0] == pytest.approx(middle[1], abs=1e-7)
    assert max(abs(x).max() for x in surface) < middle[0] < 2e-3


@pytest.mark.slow
def test_what_asks_for_no_derivatives_has_all_else_and_no_cones(stored: Stored) -> None:
    """As along a chain: every bound of C1 to C6 is the same number."""
    quads, found = stored.quads, stored.arrivals
    source = passages.arrival(stored.numbers._replace(along=""), quads[0], stored.orbits[0])
    assert source.slopes == [[], []]
    assert source.d.error == found[0].d.error
    for name in ("bound", "late", "duration", "right"):
        assert getattr(source, name) == getattr(found[0], name)
    both = [coverings.relation(x, quads[2], found[2].begin, 2) for x in (source, found[0])]
    assert both[0][:4] == both[1][:4]
    assert said(coverings.prove_cones, both[1:]) == ""
    assert said(coverings.prove_cones, both)[:2] == "C7"
    p, first, quad = problem(), step(stored.orbits[0][0]), quad_of(quads[0])
    few = p._replace(along=())
    assert script.beginning(few, quad, first)[1] == [script.beginning(p, quad, first)[1][0]]
    assert script.carried(few, first, [Fraction(1, 2**50)], [Fraction(0)]) == [
        script.carried(p, first, [Fraction(1, 2**50)] * 4, [Fraction(0)] * 4)[0]
    ]


def test_functions_of_which_only_values_are_bounded_have_no_derivative() -> None:
    """An error that is no polynomial's may have any slope; that of a number has none."""
    u = Family.of({(0, 1, 0): 2}, BITS)
    rough = Family.of_ball(arb(0, 2.0**-70), BITS)
    assert (u * u * rough).partial("u").error == 2 * (u * u * rough).error > 0
    with pytest.raises(ValueError, match="only values are bounded"):
        (u + u.widened(arb(2.0**-50)) * rough).partial("u")
    other = script.Series.made({(0, 1, 0): 1}, 0)
    thin = script.Series.of(Interval(0, 1))
    assert (other * other * thin).along(1).error == 2 * (other * other * thin).error > 0
    with pytest.raises(Fails, match="only values are bounded"):
        (other + other.wider(Fraction(1, 2)) * thin).along(1)


# ---- The stored proof.


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kept", "reason"),
    [
        ([0, 1, 2], "a section has no sets of both symbols"),
        ([0, 2], "a section has no sets of both symbols"),
        ([0, 1, 2, 0], "a section has no sets of both symbols"),
        ([0, 1, 2, 3, 0], "the symbol"),
    ],
)
def test_a_section_has_sets_of_both_symbols_that_lie_apart(
    stored: Stored, followed: None, kept: list[int], reason: str
) -> None:
    some = [stored.quads[k] for k in kept]
    mine = said(coverings.prove, stored.numbers, some, [stored.orbits[k] for k in kept])
    steps = [list(map(step, stored.orbits[k][:1])) for k in (*kept, 4)]
    line = script.Line(*stored.line)
    theirs = said(script.prove, GIVEN, list(map(quad_of, some)), line, steps)
    assert reason in mine.replace("same ", "")
    assert reason in theirs


@pytest.mark.parametrize(("factor", "reason"), [(1 + BARELY, ""), (1 - BARELY, "apart")])
@pytest.mark.parametrize("side", [1, -1])
def test_sets_of_one_symbol_are_apart_by_both_their_widths(
    stored: Stored, factor: float, reason: str, side: int
) -> None:
    """Beside each other in d, both of half-width a."""
    one = stored.quads[0]
    other = one._replace(p=(one.p[0] + side * 2 * one.a * Fraction(factor), *one.p[1:]))
    agree(
        reason,
        lambda: coverings._check_apart(one, other, "they"),
        lambda: script.check_apart(quad_of(one), quad_of(other)),
    )


@pytest.mark.slow
def test_a_line_comes_to_the_sets_by_those_between(
    stored: Stored, followed: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each covers the next, the last one the sets of its section; the line has no symbol."""
    before, orbits = [stored.quads[0], stored.quads[2]], stored.orbits
    links: Any = list(zip((stored.line, *before), (orbits[4], orbits[0], orbits[2]), strict=True))
    end, crossed, symbols = coverings.prove_line(
        stored.numbers, links, stored.quads, stored.arrivals
    )
    assert end is stored.arrivals[2]
    assert [one.target for one in crossed] == [0, 1]
    assert symbols == [stored.arrivals[0].right, stored.arrivals[2].right]
    each = Mock(return_value=True)
    with monkeypatch.context() as patch:
        patch.setattr(coverings, "prove_link", each)
        coverings.prove_line(stored.numbers, links, stored.quads, stored.arrivals)
    assert [x.args[1:] for x in each.mock_calls] == [(links[0], links[1]), (links[1], links[2])]
    # One that is not crossed, and one that is not covered by the one before.
    one = [step(x) for x in orbits[0][:1]]
    steps = [*([one] * 4), *([step(x) for x in pieces[:1]] for _, pieces in links)]
    for at, name in ((1, "line of starts"), (2, "set 1 of the approach")):
        far = links[at][0]._replace(b=links[at][0].b / 1000)
        other = [*links[:at], (far, links[at][1]), *links[at + 1 :]]
        of = stored.numbers, other, stored.quads, stored.arrivals
        assert said(coverings.prove_line, *of).startswith(f"{name}: C6: ")
        of_script = list(map(quad_of, stored.quads)), script.Line(*stored.line), steps
        theirs = said(script.prove, GIVEN, *of_script, [quad_of(x) for x, _ in other[1:]])
        assert theirs.startswith(f"set {'line' if at == 1 else '1 of the approach'}: C6: ")


@pytest.mark.parametrize(
    ("address", "word"),
    [("a 0^8 1^9 1^15", "011"), ("0110", "0110"), ("b (0^11)*3 (1^11)*2 0^9", "000110")],
)
def test_the_second_checker_reads_the_symbols_of_an_address(address: str, word: str) -> None:
    assert script.word_of(address) == word == "".join(map(str, parsed(address).symbols))


@pytest.mark.slow
def test_the_command_that_checks_certificates_proves_a_result_again(
    stored: Stored, followed: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = certificates.check(STORED, jobs=1, report=print)
    assert [type(each) for each in said] == [certificates.Theorem] * 5
    assert all(str(each).startswith("proven: ") for each in said)
    assert str(certificates.Theorem("undecided: C7")) == "undecided: C7"
    monkeypatch.setattr(coverings, "arrival", passages.arrival)
    wide = tmp_path / "wide.h5"
    wide.write_bytes(STORED.read_bytes())
    with h5py.File(wide, "r+") as file:
        file["data/sets/a"][0] *= 3
    with pytest.raises(store.StoreError, match=r"wide\.h5: undecided, nothing is proven: "):
        certificates.check(wide, jobs=1, report=print)


@pytest.mark.slow
def test_the_stored_proof_holds_in_both_checkers(
    stored: Stored, followed: None, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    numbers, quads, data = stored.numbers, stored.quads, stored.data
    arrivals, relations = coverings.prove(numbers, quads, stored.orbits[:4])
    links = [(stored.line, stored.orbits[4])]
    _, crossed, _ = coverings.prove_line(numbers, links, quads, arrivals)
    for name in ("target", "orientation", "edge", "across", "stretch", "squeeze"):
        found = [[getattr(one, name) for one in pair] for pair in relations]
        np.testing.assert_allclose(found, data["relations"][name], rtol=1e-6)
    assert [one.target for one in crossed] == [0, 1]
    np.testing.assert_allclose([one.across for one in crossed], data["line"]["across"], rtol=1e-6)
    # What docs/full-shift.md says of one passage and of two, from either section.
    up, down = ([one for pair in relations[k : k + 2] for one in pair] for k in (0, 2))
    assert min(one.stretch for one in up + down) > 156
    assert min(one.stretch for one in up) * min(one.stretch for one in down) > 10**5
    assert max(one.squeeze for one in up) * max(one.squeeze for one in down) < 1 / 4
    durations = np.array([each.duration for each in arrivals])
    assert 23.9501 < durations.min() < durations.max() < 23.9902

    def by_script(config: Path) -> tuple[int, str]:
        return script.main([str(STORED), "--config", str(config)]), capsys.readouterr().out

    code, text = by_script(CONFIG)
    assert code == 0
    assert all(theorem in text for theorem in script.FURTHER)
    assert "A = 2, 1, 3/2; r = 1, 1, 0; mu = 1/1000; h = 6671/5000:" in text
    # The times of docs/full-shift.md are proven by both, and are as wide as these are.
    assert "23.9501 to 23.9902 t'" in text
    other = tmp_path / "other.yaml"
    other.write_text(CONFIG.read_text("utf-8").replace("1.3342", "1.3343"), "utf-8")
    assert by_script(other)[0] == 1
    # Theorems 1 and 2 need neither cones nor what orbits do in the middle.
    monkeypatch.setattr(script, "check_cone", Mock(side_effect=Fails("C7: not shown")))
    monkeypatch.setattr(script, "check_middle", Mock(side_effect=Fails("C8: not shown")))
    code, text = by_script(CONFIG)
    doubts = "set 0: C7: not shown", "C8: not shown", "set 0: C7: not shown"
    assert text.endswith("".join(f"; undecided: {doubt}" for doubt in doubts) + "\n")
    # A relation that fails is named with its set.
    shifted = [*quads[:2], quads[2]._replace(p=(2 * quads[2].a, *quads[2].p[1:])), quads[3]]
    assert said(coverings.prove, numbers, shifted, stored.orbits[:4]).startswith("set 0: C6: ")


@pytest.mark.slow
def test_C9_is_asked_of_all_of_a_proof(stored: Stored, monkeypatch: pytest.MonkeyPatch) -> None:
    """Starts of one J2_0 have none; else sets, images, the strip and its own image, by both."""
    numbers, quads = stored.numbers, stored.quads
    *arrivals, start = stored.arrivals
    of_line = stored.line, stored.orbits[4], start
    asked: list[Any] = []
    kept = connections.check_crossings

    def crossings(*of: Any) -> None:
        asked.append(of)
        kept(*of)

    monkeypatch.setattr(connections, "check_crossings", crossings)
    connections.prove_transversal(numbers, of_line, quads, arrivals)
    [(strip, reach, sheets, images)] = asked
    assert strip is start
    assert [x is y for x, y in zip(images, arrivals[2:], strict=True)] == [True, True]
    assert [float(x) for x in sheets] == pytest.approx([0.816] * 5, abs=1e-3)
    # Points of a set are told to 2^-5, what is beside them too; the numbers of n = 0 on the page.
    assert [float(x.rad()) >= 2.0**-5 for x in sheets] == [False] * 3 + [True] * 2
    middle = connections.prove_connections(numbers, quads, [*arrivals, start])
    assert 0.000632 <= float(middle.small) < 0.000633
    extents = [float(sections.place(quad)[1].bound) for quad in quads[:2]]
    extents += [float(x.g.bound) for x in images]
    assert float(reach) == max(extents) > 0.0055
    held = numbers._replace(h0=numbers.h)
    assert "several energies" in said(connections.prove_transversal, held, of_line, quads, arrivals)
    p = problem()
    several = said(script.check_transversal, p._replace(h0=p.h), (None, None, None), [], [])
    assert "several energies" in several
    # C8 of the strip's image too.
    far = start._replace(d=start.d.widened(arb(0.2)))
    beyond = *of_line[:2], far
    assert said(connections.prove_transversal, numbers, beyond, quads, arrivals).startswith("C8")


@pytest.mark.parametrize(
    "moved",
    [
        pytest.param(np.array([2**62] * 4), id="come round again: 2^64 more than there are"),
        pytest.param(np.array([-(10**6), 10**6]), id="negative"),
    ],
)
def test_steps_have_the_terms_that_are_stored(stored: Stored, moved: Any) -> None:
    proof = dict(stored.data["proof"])
    terms = np.array(proof["terms"], dtype=np.int64)
    terms[: moved.size] += moved
    with pytest.raises(ValueError, match="other terms"):
        unpacked({**proof, "terms": terms}, 5)


def finer(piece: FamilyStep, by: int) -> FamilyStep:
    """The same step in units that many bits finer, and half a unit of old off in each term."""
    terms = [{at: (w << by) + (1 << by - 1) for at, w in each.items()} for each in piece.terms]
    return FamilyStep(piece.bits + by, piece.half, terms)


def test_numbers_of_more_bits_than_a_word_are_stored_whole(stored: Stored) -> None:
    """By both readers, negative ones among them."""
    steps = [[finer(piece, 30) for piece in each[:3]] for each in stored.orbits]
    steps[1] = stored.orbits[1][:3]
    again = packed(steps)
    assert set(again["family"]) > {0, 1, 5}
    found, theirs = unpacked(again, 5), script.steps_of_sets(again, 5)
    assert [[each.bits for each in of] for of in found] == [[x.bits for x in of] for of in steps]
    for mine, others, wanted in zip(found, theirs, steps, strict=True):
        for one, other, piece in zip(mine, others, wanted, strict=True):
            assert one.half == {at: w for at, w in piece.half.items() if w}
            for k, terms in enumerate(piece.terms):
                assert one.terms[k] == terms
                assert (other.states[k] - series(terms, piece.bits)).most == 0


@pytest.mark.parametrize("how", ["of no step", "a length", "not finer"])
def test_digits_that_are_added_to_nothing_are_refused(stored: Stored, how: str) -> None:
    again = packed([[finer(stored.orbits[0][0], 30)]])
    if how == "of no step":
        again["family"] = again["family"][::-1]
    elif how == "a length":
        again["coefficients"][-1, 6] = 1
        again["powers"][-1] = 0, 9, 9
    else:
        again["bits"][1] = again["bits"][0] - 1
    with pytest.raises(ValueError, match="what is added to a step is"):
        unpacked(again, 1)
    if how != "not finer":
        # The other reader takes units of any order.
        with pytest.raises(Refused, match="what is added to a step is"):
            script.steps_of_sets(again, 1)


def test_what_is_no_set_or_no_step_is_refused(stored: Stored) -> None:
    """A length that depends on time, a set without a curve, and what is no number."""
    data = stored.data
    coefficients = np.array(data["proof"]["coefficients"])
    coefficients[np.flatnonzero(data["proof"]["powers"][:, 0])[0], 6] = 1
    with pytest.raises(ValueError, match="depends on time"):
        unpacked({**data["proof"], "coefficients": coefficients}, 5)
    with pytest.raises(ValueError, match="no extent"):
        unpacked_quads({**data["sets"], "p": np.zeros((4, 0))})
    for wrong in (np.nan, np.inf):
        with pytest.raises(ValueError, match="not finite"):
            unpacked_quads({**data["sets"], "a": np.array([1, 1, 1, wrong])})
        with pytest.raises(ValueError, match=r"not finite|no interval"):
            unpacked_energies({"shift": 0.0, "spread": wrong})
    assert unpacked_energies(None) == (Fraction(0), Fraction(0))


def test_terms_have_a_largest_degree() -> None:
    most, more = (
        packed([[FamilyStep(BITS, {(0, 0, 0): 1}, [{(0, 0, degree): 1}] * 6)]])
        for degree in (MOST_DEGREE, MOST_DEGREE + 1)
    )
    assert unpacked(most, 1)[0][0].terms[5] == {(0, 0, MOST_DEGREE): 1}
    with pytest.raises(ValueError, match=f"or more than {MOST_DEGREE}"):
        unpacked(more, 1)


def spoil(file: Any, how: str) -> None:
    """Make something of a result that is no proof of this file, or more than it can be."""
    sets, proof = file["data/sets"], file["data/proof"]
    if how == "link":
        del file["data/line/half"]
        file["data/line/half"] = h5py.ExternalLink(str(STORED), "data/line/half")
    elif how == "too large":
        del sets["a"]
        sets.create_dataset("a", (1000,), "S1048576", chunks=(1,))
    elif how == "a curve has no coefficients":
        del sets["p"]
        sets["p"] = np.zeros((4, 21))
    elif how == "more terms":
        at = np.array(np.unravel_index(np.arange(10001), (40, 40, 40))).T
        for name, value in {"family": [0], "bits": [60], "terms": [len(at)], "powers": at}.items():
            del proof[name]
            proof[name] = np.array(value)
        del proof["coefficients"]
        proof["coefficients"] = np.ones((len(at), 7), dtype=np.int64)
    else:
        text = file["config"].asstr()[()].replace('"1/100000000"', '"-1"')
        if how == "lacks something":
            text = text.replace('"3/2"', '"3/2", "1"')
        del file["config"]
        file["config"] = text


SPOILT = ["link", "too large", "a curve has no coefficients", "more terms", "lacks something"]


@pytest.mark.parametrize("how", [*SPOILT, "J1_0 > 0 is broken"])
def test_a_file_that_is_no_proof_is_refused_at_once(how: str, tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "other.h5"
    path.write_bytes(STORED.read_bytes())
    with h5py.File(path, "r+") as file:
        spoil(file, how)
    assert script.main([str(path)]) == 1
    assert how in capsys.readouterr().err
