"""Covering relations: each hypothesis barely true and barely false, with limits of the page."""

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from flint import arb

from rigidpend.experiments.full_shift import proof
from rigidpend.experiments.full_shift.schema import Config
from rigidpend.routes.certified import connections, coverings, passages, sections
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.proof_data import Undecided, quad_from
from rigidpend.routes.symbolic.address import parsed
from rigidpend.runs import certificates
from scripts import (
    check_connections,
    check_coverings,
    check_full_shift,
    check_passages,
    check_sections,
    check_series,
)
from scripts.check_certificate import Fails, Interval
from tests.config.samples import content as typed
from tests.routes.certified import offered
from tests.routes.certified.offered import BARELY, BITS, CONFIG, Stored, agree, quad_of, said, step

ALONE = 2.0**-5


# ---- C6


STRAIGHT = quad_from(True, (0.25, 0.5, 0.125, -0.5), [(0.0,), (0.25,)])
"""A straight set, which moves with the energy."""
IN, OUT, SIDES = 1 - BARELY, 1 + BARELY, [*itertools.product((1, -1), repeat=2)]


@pytest.mark.parametrize(
    ("ends", "aside", "wide", "across", "off", "reason"),
    [
        *((s * OUT, 0.0, 0.0, IN, None, "") for s in (1, -1)),
        (IN, 0.0, 0.0, IN, None, "C6: an edge"),
        # One edge is beyond an end, and the other one is not.
        *((s * 1.5, t * (0.5 + BARELY), 0.0, IN, None, "C6: an edge") for s, t in SIDES),
        (0.5, 3.0, 0.0, IN, None, "C6: an edge"),
        # One edge lies partly beyond an end.
        *((s * 1.5, t * 0.25, 0.25 + BARELY, IN, None, "C6: an edge") for s, t in SIDES),
        *((s * 1.5, t * 0.25, 0.25 - BARELY, IN, None, "") for s, t in SIDES),
        (OUT, 0.0, 0.0, OUT, None, "C6: the image"),
        # Q, gamma1 or gamma2.
        *((OUT, 0.0, 0.0, IN, k, "C6: the crossings") for k in range(3)),
    ],
)
def test_C6_images_lie_across_a_set(
    ends: float, aside: float, wide: float, across: float, off: int | None, reason: str
) -> None:
    """U = ends u + aside + wide v and V = across v, at all energies; one may be off its sheet."""
    a, b, l0, l1 = (float(x) for x in STRAIGHT[1:5])
    d = {(0, 1, 0, 0): 2 * a * ends, (0, 0, 0, 1): 2 / 4, (0, 0, 0, 0): 2 * a * aside}
    d |= {(0, 0, 1, 0): 2 * a * wide}
    g = {(0, 1, 0): 2 * a * ends / l1, (0, 0, 1): 2 * (a * wide - b * across) / l1}
    g |= {(0, 0, 0): 2 * (a * aside - l0) / l1}
    begin = [arb(1), arb(0.5), arb(0.5)]
    box = [x + (OUT if k == off else IN) * ALONE for k, x in enumerate(begin)]
    source, other = offered.arrived([offered.whole(d), offered.whole(g)], box)
    agree(
        reason,
        lambda: coverings.relation(source, STRAIGHT, begin, 0),
        lambda: check_coverings.check_relation(
            other, quad_of(STRAIGHT), list(map(offered.interval, begin))
        ),
    )
    if reason:
        # A bound on a size is none below zero.
        assert ">= -" not in said(coverings.relation, source, STRAIGHT, begin, 0)
    else:
        found = coverings.relation(source, STRAIGHT, begin, 0)
        assert found.orientation == math.copysign(1, ends)
        beyond = abs(ends) - abs(aside) - wide
        # The radius of a ball has 30 bits.
        least = 1e-12 if wide == 0 else 2.0**-30
        np.testing.assert_allclose(found.edge, beyond, rtol=least)
        np.testing.assert_allclose(found.across, across, rtol=1e-12)


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
    quad = quad_from(True, (2.0**-10, 2.0**-9, 0.0, -0.5), [curve, (0.25,)])
    a, b, _, l1 = (float(x) for x in quad[1:5])
    of_d, level = [a * x for x in U], (w_u, 0.0, 1.0)
    of_g = [(a * x - b * y) / l1 for x, y in zip(U, V, strict=True)]
    axes = (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)
    rows = [
        offered.whole({at: 2 * x for at, x in zip(axes, row, strict=True)})
        for row in (of_d, of_g, level)
    ]
    # d = p(g) + w/4 + a U, whole in u, v and w.
    off, up, w = (Family.of(row, BITS) for row in rows)
    at = sections.moved(quad.p, up, w) + off
    slopes = [(at.partial(name), up.partial(name), w.partial(name)) for name in "uvw"]
    there = arb(1), arb(1), arb(1)
    of = passages.Reached(at, up, True, there, 0.0, 0.0, (1.0, 1.0), [], slopes, w)
    stretch, squeeze = coverings.cone(of, quad)
    assert stretch == pytest.approx(abs(U[0]) - abs(U[1]) - U[2] / 64 - 64 * abs(w_u), abs=1e-9)
    assert squeeze == pytest.approx(abs(V[0]) + abs(V[1]) + V[2] / 64, abs=1e-9)
    off_, up_, w_ = (offered.series(row, BITS) for row in rows)
    at_ = quad_of(quad).curve(up_, w_) + off_
    along = [tuple(each.partial(i) for each in (at_, up_, w_)) for i in check_series.ALONG]
    other = check_passages.Arrival(at_, up_, 1, [], [], Interval.of(0), along, w_)
    one = coverings.Relation(0, 1, 2.0, 0.5, stretch, squeeze)
    held = one._replace(stretch=2.0, squeeze=0.5)
    agree(
        reason,
        lambda: coverings.prove_cones([held, one, held]),
        lambda: check_coverings.check_cone(other, quad_of(quad)),
    )
    if reason:
        assert said(coverings.prove_cones, [one]).endswith("; a larger mu/h may help")
        assert said(coverings.prove_cones, [one], "luck").endswith("; luck may help")


@pytest.fixture
def followed(stored: Stored, monkeypatch: pytest.MonkeyPatch) -> None:
    """The orbits of the stored sets and line are followed once, for all tests."""
    monkeypatch.setattr(coverings, "arrival", stored.followed(stored.arrivals))
    monkeypatch.setattr(check_coverings, "arrival", stored.followed(stored.theirs))


def by_script(kept: Sequence[int] = range(4), *approach: int) -> check_coverings.Proven:
    """What the second checker proves of some of the stored sets, the line, and sets between."""
    found = check_full_shift.read(offered.STORED)
    return check_coverings.prove(
        offered.GIVEN,
        [found.quads[k] for k in kept],
        check_sections.Line(offered.J1, *found.line),
        [found.orbits[k] for k in (*kept, 4, *approach)],
        [found.quads[k] for k in approach],
    )


@pytest.mark.slow
def test_cones_and_the_middle_are_asked_of_all(
    stored: Stored, followed: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of eight relations of the sets and two of the line, and of the largest |d|, by both."""
    cones, other_cones, middle = Mock(side_effect=Undecided("C7")), Mock(), Mock()
    monkeypatch.setattr(coverings, "prove_cones", cones)
    monkeypatch.setattr(check_coverings, "check_cone", other_cones)
    for module, name in ((connections, "prove_"), (check_coverings, "check_")):
        monkeypatch.setattr(module, "check_middle", middle)
        monkeypatch.setattr(module, f"{name}transversal", lambda *_: None)
    found = proof.checked(typed(Config, CONFIG, []), stored.data)
    by_script()
    # What else Theorem 8 needs is named in its place.
    assert found.doubts == ("C7", "", "C7")
    relations, _ = cones.call_args.args
    assert relations == [*itertools.chain(*found.relations), *found.crossed]
    # Each of another passage or to another set.
    asked = {(id(x), y.rising, y.a) for x, y in (call.args for call in other_cones.mock_calls)}
    assert len(asked) == len(relations) == 10
    # Both add their bounds on the distance and on the time of the crossing, 1e-7.
    mine, theirs = (float(call.args[1]) for call in middle.mock_calls)
    assert mine == pytest.approx(theirs, abs=1e-7)


def test_functions_of_which_only_values_are_bounded_have_no_derivative() -> None:
    """An error that is no polynomial's may have any slope; that of a number has none."""
    u = Family.of({(0, 1, 0): 2}, BITS)
    rough = Family.of_ball(arb(0, 2.0**-70), BITS)
    assert (u * u * rough).partial("u").error == 2 * (u * u * rough).error > 0
    with pytest.raises(ValueError, match="only values are bounded"):
        (u + u.widened(arb(2.0**-50)) * rough).partial("u")
    other = check_series.Series.made({(0, 1, 0): 1}, 0)
    thin = check_series.Series.of(Interval(0, 1))
    assert (other * other * thin).partial(1).error == 2 * (other * other * thin).error > 0
    with pytest.raises(Fails, match="only values are bounded"):
        (other + other.wider(Fraction(1, 2)) * thin).partial(1)


# ---- The stored proof.


@pytest.mark.slow
def test_sections_have_both_symbols(
    stored: Stored, followed: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    lacking, lines = "a section has no sets of both symbols", list[str]()
    monkeypatch.setattr(coverings, "note", lambda text: lines.append(text()))
    for kept in ([0, 1, 2], [0, 2], [0, 1, 2, 0], [0, 1, 2, 3, 0]):
        some = [stored.quads[k] for k in kept], [stored.orbits[k] for k in kept]
        mine, theirs = said(coverings.prove, stored.numbers, *some), said(by_script, kept)
        reason = lacking if len(kept) < 5 else "the symbol"
        assert reason in mine.replace("same ", "")
        assert reason in theirs
    assert lines[:3] == [f"polynomials of set {k} of 0 to 2 are checked" for k in range(3)]


@pytest.mark.parametrize(("factor", "reason"), [(1 + BARELY, ""), (1 - BARELY, "apart")])
@pytest.mark.parametrize("side", [1, -1])
def test_sets_of_a_symbol_are_apart(stored: Stored, factor: float, reason: str, side: int) -> None:
    """Beside each other in d, both of half-width a."""
    one = stored.quads[0]
    first, *rest = one.p[0]
    other = one._replace(p=((first + side * 2 * one.a * Fraction(factor), *rest),))
    agree(
        reason,
        lambda: coverings.check_apart(one, other, "they"),
        lambda: check_coverings.check_apart(quad_of(one), quad_of(other)),
    )


@pytest.mark.slow
def test_a_line_comes_to_the_sets_by_those_between(stored: Stored, followed: None) -> None:
    """Each covers the next, the last one the sets of its section; the line has no symbol."""
    before, orbits = stored.quads[1:3], stored.orbits
    links: Any = list(zip((stored.line, *before), (orbits[4], *orbits[1:3]), strict=True))
    end, crossed, symbols = coverings.prove_line(
        stored.numbers, links, stored.quads, stored.arrivals
    )
    assert end is stored.arrivals[2]
    assert [one.target for one in crossed] == [0, 1]
    assert symbols == [True, False] == [each.right for each in stored.arrivals[1:3]]
    assert not stored.arrivals[4].right
    empty = [links[0], (links[1][0], []), links[2]]
    doubt = said(coverings.prove_line, stored.numbers, empty, stored.quads, stored.arrivals)
    assert doubt.startswith("line of starts: C6: the next set")
    # One that is not crossed, and one that is not covered by the one before.
    one = [step(x) for x in orbits[0][:1]]
    steps = [*([one] * 4), *([step(x) for x in pieces[:1]] for _, pieces in links)]
    for at, name in ((1, "line of starts"), (2, "set 1 of the approach")):
        far = links[at][0]._replace(b=links[at][0].b / 1000)
        other = [*links[:at], (far, links[at][1]), *links[at + 1 :]]
        of = stored.numbers, other, stored.quads, stored.arrivals
        assert said(coverings.prove_line, *of).startswith(f"{name}: C6: ")
        of_script = list(map(quad_of, stored.quads)), offered.line_of(stored.line), steps
        theirs = said(
            check_coverings.prove, offered.GIVEN, *of_script, [quad_of(x) for x, _ in other[1:]]
        )
        assert theirs.startswith(f"set {'line' if at == 1 else '1 of the approach'}: C6: ")


@pytest.mark.slow
@pytest.mark.parametrize("source", range(5))
def test_each_image_has_to_lie_across_all_sets_of_its_section(
    stored: Stored, followed: None, monkeypatch: pytest.MonkeyPatch, source: int
) -> None:
    """By both, of four sets and of the line of starts, whose images are too wide one by one."""
    mine, theirs = list(stored.arrivals), list(stored.theirs)
    mine[source] = mine[source]._replace(d=mine[source].d.widened(arb(1)))
    theirs[source] = theirs[source]._replace(d=theirs[source].d.wider(Fraction(1)))
    monkeypatch.setattr(coverings, "arrival", stored.followed(mine))
    monkeypatch.setattr(check_coverings, "arrival", stored.followed(theirs))
    quads, of_line = stored.quads, [(stored.line, stored.orbits[4])]

    def by_package() -> None:
        coverings.prove(stored.numbers, quads, stored.orbits[:4])
        coverings.prove_line(stored.numbers, of_line, quads, mine[:4])

    agree(f"set {source}: C6" if source < 4 else "C6", by_package, by_script)


@pytest.mark.slow
def test_nothing_is_said_of_crossing_surfaces_behind_an_approach(
    followed: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if all that is asked of the strip's image held for that of the approach's last set."""
    for name in ("check_strip", "check_graph", "check_crossings"):
        monkeypatch.setattr(check_connections, name, Mock())
    assert by_script().doubts[2] == ""
    told = ["", "", "C9: the starts come to the sets by an approach"]
    assert by_script(range(4), 0).doubts == told


@pytest.mark.parametrize(
    ("address", "word"),
    [("a 0^8 1^9 1^15", "011"), ("0110", "0110"), ("b (0^11)*3 (1^11)*2 0^9", "000110")],
)
def test_the_second_checker_reads_the_symbols_of_an_address(address: str, word: str) -> None:
    assert check_full_shift.word_of(address) == word == "".join(map(str, parsed(address).symbols))


@pytest.mark.slow
def test_the_stored_proof_holds_in_both_checkers(
    stored: Stored, followed: None, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, found = stored.data, proof.checked(typed(Config, CONFIG, []), stored.data)
    for name in ("target", "orientation", "edge", "across", "stretch", "squeeze"):
        numbers = [[getattr(one, name) for one in pair] for pair in found.relations]
        np.testing.assert_allclose(numbers, data["relations"][name], rtol=1e-6)
    across = [one.across for one in found.crossed]
    np.testing.assert_allclose(across, data["line"]["across"], rtol=1e-6)
    # What docs/full-shift.md says of one passage and of two, from either section.
    up, down = ([one for pair in found.relations[k : k + 2] for one in pair] for k in (0, 2))
    assert min(one.stretch for one in up + down) > 156
    assert min(one.stretch for one in up) * min(one.stretch for one in down) > 10**5
    assert max(one.squeeze for one in up) * max(one.squeeze for one in down) < 1 / 4
    durations = np.array([each.duration for each in found.arrivals])
    assert 23.9501 < durations.min() < durations.max() < 23.9902
    told = list(map(str, certificates.check(offered.STORED, jobs=1, report=print)))
    assert [each.partition(": ")[0] for each in told] == ["proven"] * 5
    assert "of A = 2, 1, 1.5; r = 1, 1, 0; mu = 0.001; h = 1.3342; J1_0 = 1e-8: " in told[0]
    words = told[1].split()
    low, high = (float(words[words.index(x) + 1]) for x in ("from", "to"))
    # Theorem 2's are those of the second checker, whose intervals are wider.
    assert (
        1.55099 < low < data["line"]["theta2"].min() < data["line"]["theta2"].max() < high < 1.57388
    )

    def main(config: Path) -> tuple[int, str]:
        return check_full_shift.main(
            [str(offered.STORED), "--config", str(config)]
        ), capsys.readouterr().out

    capsys.readouterr()
    code, text = main(CONFIG)
    assert code == 0
    assert all(theorem in text for theorem in check_full_shift.FURTHER)
    assert "A = 2, 1, 3/2; r = 1, 1, 0; mu = 1/1000; h = 6671/5000:" in text
    # The times of docs/full-shift.md are proven by both, and are as wide as these are.
    assert "23.9501 to 23.9902 t'" in text
    other = tmp_path / "other.yaml"
    other.write_text(CONFIG.read_text("utf-8").replace("1.3342", "1.3343"), "utf-8")
    assert main(other)[0] == 1
    # Theorems 1 and 2 need neither cones nor what orbits do in the middle.
    monkeypatch.setattr(check_coverings, "check_cone", Mock(side_effect=Fails("C7: not shown")))
    monkeypatch.setattr(check_coverings, "check_middle", Mock(side_effect=Fails("C8: not shown")))
    code, text = main(CONFIG)
    doubts = "set 0: C7: not shown", "C8: not shown", "set 0: C7: not shown"
    assert text.endswith("".join(f"; undecided: {doubt}" for doubt in doubts) + "\n")
    # A relation that fails is named with its set, and no orbits of another one are followed.
    quads = stored.quads
    shifted = [*quads[:2], quads[2]._replace(p=((2 * quads[2].a, *quads[2].p[0][1:]),)), quads[3]]
    monkeypatch.setattr(
        coverings, "arrival", asked := Mock(side_effect=stored.followed(stored.arrivals))
    )
    doubt = said(coverings.prove, stored.numbers, shifted, stored.orbits[:4])
    assert doubt.startswith("set 0: C6: ")
    assert asked.call_count == 1


@pytest.mark.slow
def test_C9_is_asked_of_all_of_a_proof(stored: Stored, monkeypatch: pytest.MonkeyPatch) -> None:
    """Starts of one J2_0 have none; else sets, images, the strip and its own image, by both."""
    numbers, quads = stored.numbers, stored.quads
    *arrivals, start = stored.arrivals
    *theirs, image = stored.theirs
    p, of_line = offered.problem(), (stored.line, stored.orbits[4], start)
    again = offered.line_of(stored.line), step(stored.orbits[4][0]), image
    asked = Mock()
    with monkeypatch.context() as patch:
        patch.setattr(connections, "check_crossings", asked)
        patch.setattr(check_connections, "check_crossings", asked)
        connections.prove_transversal(numbers, of_line, quads, arrivals)
        check_connections.check_transversal(p, again, list(map(quad_of, quads)), theirs)
    mine, other = (call.args for call in asked.mock_calls)
    for (strip, _, __, images), (*own, last) in ((mine, stored.arrivals), (other, stored.theirs)):
        assert strip is last
        assert [x is y for x, y in zip(images, own[2:], strict=True)] == [True, True]
    # Points of a set are told to 2^-5, what is beside them too; the numbers of n = 0 on the page.
    sheets, wide = mine[2], [False] * 3 + [True] * 2
    assert [float(x) for x in sheets] == pytest.approx([0.816] * 5, abs=1e-3)
    assert [float(x.rad()) >= ALONE for x in sheets] == wide
    assert sorted(x.high - x.low >= 2 * ALONE * 2**Interval.digits for x in other[2]) == wide
    extents = [float(sections.place(quad)[1].bound) for quad in quads[:2]]
    assert float(mine[1]) == max(extents + [float(x.g.bound) for x in mine[3]]) > 0.0055
    assert float(other[1]) == pytest.approx(float(mine[1]), rel=1e-5)
    middle = connections.prove_connections(numbers, quads, [*arrivals, start])
    assert 0.000632 <= float(middle.small) < 0.000633
    held = numbers._replace(h0=numbers.h)
    agree(
        "several energies",
        lambda: connections.prove_transversal(held, of_line, quads, arrivals),
        lambda: check_connections.check_transversal(p._replace(h0=p.h), again, [], []),
    )
    # C8 of the strip's image too.
    far = start._replace(d=start.d.widened(arb(0.2)))
    beyond = *of_line[:2], far
    assert said(connections.prove_transversal, numbers, beyond, quads, arrivals)[:2] == "C8"
