"""Sets that move with the energy: starts of one J2_0, intervals of energies, by both checkers."""

import itertools
import math
import random
from contextlib import nullcontext
from fractions import Fraction
from types import SimpleNamespace
from typing import Any, NamedTuple
from unittest.mock import Mock

import numpy as np
import pytest
from flint import arb

from rigidpend import Body
from rigidpend.experiments.contract import Means
from rigidpend.experiments.full_shift import compute as full_shift
from rigidpend.experiments.full_shift import proof
from rigidpend.experiments.full_shift.schema import Config
from rigidpend.numbers.exact import exact
from rigidpend.routes.certified import (
    chains,
    coverings,
    family_orbits,
    horseshoe,
    passages,
    proof_data,
    sections,
    start_lines,
)
from rigidpend.routes.certified.orbit import enclosed
from rigidpend.routes.certified.proof_data import Quad, unpacked, unpacked_energies, unpacked_quads
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.symbolic import find_orbit
from rigidpend.routes.symbolic.levels import onward
from scripts import check_full_shift, check_sections, check_series
from scripts.check_certificate import Interval, Refused
from tests.attacks import lot
from tests.config.samples import content as typed
from tests.routes.certified import offered
from tests.routes.certified.offered import BODY, CONFIG, GIVEN, H0, J1, points, said, value

OWN = ["problem.h=null", "problem.h0=1.3342"]
"""The starts of Fig. 4 themselves."""


class Found(NamedTuple):
    """What the experiment finds and proves of starts of one J2_0."""

    data: Any
    proven: proof.Proven
    quads: list[Quad]
    orbits: list[list[proof_data.FamilyStep]]
    """Steps of the four sets and of the line."""
    shift: Fraction
    spread: Fraction


@pytest.fixture(scope="module")
def found() -> Found:
    proven: list[proof.Proven] = []
    check = proof.checked

    def checked(config: Config, data: Any) -> proof.Proven:
        proven.append(check(config, data))
        return proven[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(full_shift, "checked", checked)
        data = full_shift.compute(typed(Config, CONFIG, OWN), Means())
    quads, energies = unpacked_quads(data["sets"], data["energies"]), data["energies"]
    orbits = unpacked(data["proof"], 5)
    return Found(data, proven[0], quads, orbits, *unpacked_energies(energies))


def test_a_strip_about_a_line_of_starts_and_bits_are_the_same_in_other_units() -> None:
    """Energies 10,000 times as large or small, momenta 100 times: small ones have finer units."""
    found = []
    for by, finer in ((Fraction(1), 0), (Fraction(100), 0), (Fraction(1, 100), 7)):
        body = Body(A=GIVEN["A"], r=GIVEN["r"], mu=str(by**2 / 1000))
        of = horseshoe.ShiftProblem(body, exact(Fraction(GIVEN["h"]) * by**2), 1)
        [setting] = horseshoe.trials(of, 18)
        line, _ = start_lines.line(setting, J1 * by, horseshoe.quads(setting))
        found.append((float(line.wide / by), setting.bits - finer))
    assert found[1] == pytest.approx(found[0], rel=1e-6)
    assert found[2] == pytest.approx(found[0], rel=1e-6)
    assert min(found[0]) > 0
    assert horseshoe.FEWEST_BITS < found[0][1] < horseshoe.MOST_BITS


@pytest.mark.slow
def test_an_approach_ends_across_both_sets_of_its_section() -> None:
    """The last set of an approach in the window of Fig. 4's right array, after 01 and before 1."""
    found = find_orbit(BODY, "a 0^8 1^9 1^15", h0=H0, J1_0=exact(J1), digits=17)
    assert 3 * math.pi / 40 < found.theta2_0 < 3 * math.pi / 40 + 0.31
    orbit = chains.OrbitCrossings(float(found.theta2_0), found.d, found.chi)
    # At the energy of the middle alone.
    setting = start_lines.of_start(BODY, H0, J1, orbit.theta2)._replace(half_turns=14)
    quads = horseshoe.quads(setting)
    *_, link = chains.links(setting, J1, orbit, quads)
    link = link._replace(setting=link.setting._replace(spread=Fraction(0)))
    targets = [(quad, family_orbits.pieces(setting, quad)[0]) for quad in quads if not quad.rising]
    # Of sets so high that the image does not reach from end to end.
    targets += [(quad._replace(a=1000 * quad.a), first) for quad, first in targets]
    numbers = sections.Numbers.of(BODY, setting.h)._replace(along="")
    assert isinstance(link.start, Quad)
    image = passages.arrival(numbers, link.start, link.pieces())
    begun = [sections.beginning(numbers, *each)[0] for each in targets]
    each = zip(targets, begun, strict=True)
    reasons = [said(coverings.relation, image, quad, there, 0)[:2] for (quad, _), there in each]
    assert reasons == ["", "", "C6", "C6"]


def test_a_line_is_about_its_orbit_and_a_set_keeps_away_from_the_stable_surface() -> None:
    """Beside that chi of the next crossing grows as -ln of the distance over Lambda."""
    theta2, setting = 4.704, horseshoe.ShiftProblem(BODY, H0, 14)
    begun = start_lines.LineStarts(setting, J1).entered(np.array([theta2])).point
    passed = list(onward(setting.level, begun, 2, slopes=True))
    points = [begun, *(each.point for each in passed)]
    orbit = chains.OrbitCrossings(
        theta2, *(np.concatenate([getattr(x, name) for x in points]) for name in ("d", "chi"))
    )
    line, first, second = chains.links(setting, J1, orbit)
    assert sum(line.theta2) / 2 == pytest.approx(theta2, rel=1e-15, abs=0)
    away = 1 / abs(float(setting.level.exponent[0, 0]) * passed[0].slopes[1, 0, 0])
    sets = [link.start for link in (first, second) if isinstance(link.start, Quad)]
    assert float(sets[0].a) / away == pytest.approx(1 / 2000)
    # Each is as wide as it is long, at least, and holds the image of the one before.
    assert sets[1].b >= sets[1].a


def test_sets_of_more_half_rotations_are_as_far_apart_as_the_map_tells() -> None:
    """Of each symbol two, of 14 and 16 half rotations."""
    quads = horseshoe.quads(horseshoe.ShiftProblem(BODY, exact(GIVEN["h"]), 14, lengths=2))
    assert [quad.rising for quad in quads] == [True] * 4 + [False] * 4
    for k in (0, 2, 4, 6):
        assert said(coverings.check_apart, *quads[k : k + 2], "they") == ""


@pytest.mark.slow
def test_all_eight_relations_are_proven_of_starts_of_one_J2_0(found: Found) -> None:
    """And what docs/full-shift.md says of them."""
    proven, data = found.proven, found.data
    assert [len(pair) for pair in (*proven.relations, proven.crossed)] == [2] * 5
    assert proven.doubts[0] == ""
    letters = zip(data["sets"]["rising"], data["sets"]["symbol"], strict=True)
    assert set(letters) == set(itertools.product((False, True), (0, 1)))
    off = Fraction("1.33519996") - Fraction("1.3342") - found.shift
    assert abs(off) + Fraction("2.7e-8") <= found.spread
    assert 1.559 < data["line"]["theta2"].min() < data["line"]["theta2"].max() < 1.565
    shortest, longest = data["sets"]["shortest"], data["sets"]["longest"]
    assert 23.94 < shortest.min() < longest.max() < 23.99
    assert (shortest < longest).all()
    squeeze, stretch = data["relations"]["squeeze"], data["relations"]["stretch"]
    assert squeeze[:2].max() * squeeze[2:].max() < 1 / 3
    assert stretch[:2].min() * stretch[2:].min() > 1e5


@pytest.mark.slow
def test_orbits_of_all_energies_do_what_the_polynomials_say(found: Found) -> None:
    """In pairs of doubles, from random points of a set at random energies of its own."""
    quad, arrival = found.quads[2], found.proven.arrivals[2]
    with lot.drawn("orbits of several energies") as chance:
        for _ in range(3):
            u, v, w = (chance.uniform(-1, 1) for _ in range(3))
            exactly = Fraction(w)
            curves = zip(*quad.p, strict=True)
            there = tuple(
                sum((x * exactly**m for m, x in enumerate(each)), Fraction(0)) for each in curves
            )
            energy = Fraction("1.3342") + found.shift + found.spread * exactly
            begin = points(quad._replace(p=(there,)), [u], [v], energy)
            end = offered.crossings(begin, offered.duration(found.orbits[2], u, v, w))[0][:, 0]
            sign = -1 if end[0] < 0 else 1
            for family, x in ((arrival.d, end[1]), (arrival.g, end[5])):
                assert abs(float(sign * x) - value(family, u, v, w)) < family.error / 2**family.bits


@pytest.mark.slow
def test_the_line_of_starts_is_that_of_fig_4(found: Found) -> None:
    """Its polynomials begin at the starts of route codes, and w is that of their energies."""
    problem, line = RouteProblem(BODY, H0, exact(J1), 1), found.data["line"]
    begin = sections.begun(found.orbits[4][0])
    for theta2 in (Fraction("1.56"), Fraction("1.5625"), Fraction("1.564")):
        start = enclosed(problem, exact(theta2), 160)
        Qp, Qm, M3, *gamma = (float(x.mid()) for x in start.state)
        unit, c = float(start.unit), start.numbers.field
        u = (line["e1"] * gamma[0] + line["e2"] * gamma[1] - line["centre"]) / line["half"]
        values = [value(each, u, 0.0) for each in begin]
        np.testing.assert_allclose(values, [unit * Qp, Qm, unit * M3, *gamma], atol=1e-12)
        # kappa J2_0^2/2 is h0, and so the energy is more than it by the weight alone.
        height = unit**2 * (float(c.mu_r1.mid()) * gamma[0] + float(c.mu_r2.mid()) * gamma[1])
        w = float((Fraction(height) - found.shift) / found.spread)
        assert value(found.proven.start.w, u, 0.0) == pytest.approx(w, abs=1e-6)
        assert abs(w) < 1
    # It changes along the line, and with nothing else.
    end, by = found.proven.start, 2.0**-8
    change = (value(end.w, by, 0.0) - value(end.w, -by, 0.0)) / (2 * by)
    slopes = [value(of_w, 0.0, 0.0) for _, _, of_w in end.slopes]
    assert slopes == pytest.approx([change, 0.0, 0.0], rel=1e-4, abs=1e-12)
    assert abs(change) > 0.1


@pytest.mark.slow
def test_outlines_are_those_of_the_sets_in_the_chart(found: Found) -> None:
    """U and V less the mean curve are -1 and 1 around each set; images lie across the others."""
    drawn = found.data["drawn"]

    def sizes(quad: Any, chi: Any, d: Any) -> tuple[Any, Any]:
        g, alike = -np.sin(chi), [x for x in found.quads if x.rising == quad.rising]
        mean = np.mean([np.array(x.p[0], dtype=float) for x in alike], axis=0)
        off = d + np.polynomial.polynomial.polyval(g, mean - np.array(quad.p[0], dtype=float))
        V = (off - float(quad.l0) - float(quad.l1) * g) / float(quad.b)
        return abs(off / float(quad.a)), abs(V)

    np.testing.assert_allclose(drawn["d"][:, -1], drawn["d"][:, 0], rtol=1e-9)
    edges = np.arange(4 * full_shift.SIDE) // full_shift.SIDE % 2 == 1
    images = zip(drawn["image_chi"], drawn["image_d"], strict=True)
    across = [(x.rising, edges, *image) for x, image in zip(found.quads, images, strict=True)]
    across.append(
        (False, slice(None, None, full_shift.SIDE - 1), drawn["line_chi"], drawn["line_d"])
    )
    for quad, chi, d in zip(found.quads, drawn["chi"], drawn["d"], strict=True):
        np.testing.assert_allclose(np.maximum(*sizes(quad, chi, d)), 1, atol=1e-6)
        for rising, ends, *image in across:
            if rising != quad.rising:
                U, V = sizes(quad, *image)
                assert U[ends].min() > 1 > V.max()


def test_longer_passages_ask_for_more_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are nearer to a surface by exp(2 pi Lambda) for two more, here of Lambda = 1/sqrt(8)."""
    monkeypatch.setattr(horseshoe, "quads", lambda _: [SimpleNamespace(b=x) for x in (2e-7, 1e-7)])
    of = [horseshoe.ShiftProblem(BODY, H0, 14, lengths=n) for n in (1, 2, 3)]
    own = horseshoe.SPARE_BITS - 2 * math.log2(1e-7 / of[0].width)
    nearer = 2 * math.pi / math.sqrt(8) / math.log(2)
    for k, setting in enumerate(of):
        [found] = horseshoe.trials(setting, 14)
        assert found.bits == math.ceil(own + 2 * nearer * k)


@pytest.mark.parametrize(("by", "inside"), [("99/100", True), ("101/100", False)])
@pytest.mark.parametrize("sign", [1, -1])
def test_energies_are_those_within_their_spread(by: str, inside: bool, sign: int) -> None:
    spread, h = Fraction("1e-6"), Fraction(GIVEN["h"])
    energy = h + sign * Fraction(by) * spread
    mine = sections.Numbers.of(BODY, exact(GIVEN["h"]), spread).energies.range
    assert mine.contains(arb(energy.numerator) / energy.denominator) is inside
    theirs = check_sections.problem_of({**GIVEN, "spread": spread}).energies.ball()
    assert (theirs.low <= Interval.of(energy).low <= theirs.high) is inside


@pytest.mark.parametrize(
    ("changes", "shift", "by", "reason"),
    [
        # The doubles beside half of their width, which is none.
        (["problem.around=1e-6"], 0, 1 + 2**-51, ""),
        (["problem.around=1e-6"], 0, 1 - 2**-51, "the energies are not"),
        (["problem.around=1e-6"], 1e-9, 1 + 2**-51, "the energies are not"),
        ([], 1e-9, 1, "the energies are not"),
        (OWN, 0, 0, "starts of one J2_0"),
        (OWN, 1e-3, 1, ""),
    ],
)
def test_a_proof_is_of_the_energies_of_its_config(
    stored: Any, monkeypatch: Any, changes: list[str], shift: float, by: float, reason: str
) -> None:
    """By both; nothing else is asked before it."""
    spread = Fraction(1.3342e-6 * by)
    monkeypatch.setattr(coverings, "prove", proved := Mock(side_effect=proof_data.Undecided))
    energies = {"shift": shift, "spread": float(spread), "moves": np.zeros((4, 1, 1)), "line": []}
    data = stored.data | ({"energies": energies} if by else {})
    doubt = said(proof.checked, typed(Config, CONFIG, changes), data)
    assert doubt.startswith(reason)
    assert proved.called is not bool(reason)
    if proved.called:
        numbers = proved.call_args.args[0]
        assert (numbers.h0 is None, numbers.spread) == (changes != OWN, spread)
    given = {name: GIVEN[name] for name in ("A", "r", "mu")} | {"J1_0": "1e-8"}
    given["h0" if changes == OWN else "h"] = GIVEN["h"]
    given["around"] = "1e-6" if len(changes) == 1 else "0"
    config = {"experiment": "full_shift", "problem": given}
    read = check_full_shift.Read(config, [], [], [], [], Fraction(shift), spread)
    with pytest.raises(Refused, match="energies") if reason else nullcontext():
        assert check_full_shift.energies_of(read)["spread"] == spread


@pytest.mark.parametrize(
    ("theta2", "J1"), [*((x, J1) for x in (0.0, 0.7, 2.5, 3.5, 6.0)), (0.7, Fraction("1e-3"))]
)
def test_phases_are_told_in_every_quarter(monkeypatch: Any, theta2: float, J1: Fraction) -> None:
    """By both, hardly wider than the line; a large J1 counts, a small one is nothing beside M3."""
    given = {**GIVEN, "r": ("1", "2", "0"), "h0": GIVEN["h"]}
    body = Body(given["A"], given["r"], given["mu"])
    setting = horseshoe.ShiftProblem(body, H0, 1, h0=H0)
    ends = theta2 + np.array([-1e-6, 1e-6])
    shifts = start_lines.LineStarts(setting, J1).energies(ends)
    shift, spread = Fraction(float(shifts.mean())), Fraction(float(np.abs(np.diff(shifts))[0]))
    setting = setting._replace(h=H0 + exact(shift), spread=spread)
    line, _ = start_lines.LineStarts(setting, J1).between(ends)
    first, *_ = start_lines.line_pieces(setting, line, (float(ends[0]), float(ends[1])))
    numbers = sections.Numbers.of(body, setting.h, spread, H0)
    del given["h"]
    problem = check_sections.problem_of({**given, "shift": shift, "spread": spread})
    theirs = check_sections.phases(problem, offered.line_of(line), offered.step(first))
    bounds = Fraction(theirs.low, 1 << check_series.DIGITS), theirs.above
    for low, high in (sections.phases(numbers, line, [first]), map(float, bounds)):
        assert low <= ends[0] + 1e-12 < ends[1] - 1e-12 <= high
        assert 2e-6 - 1e-12 < high - low < 2e-5
    # How far the polynomials are from the starts counts.
    beginning, line_beginning = sections.beginning, check_sections.line_beginning

    def loose(*given: Any) -> Any:
        begin, (bound, *others) = beginning(*given)
        return begin, [bound + arb(1e-3), *others]

    monkeypatch.setattr(sections, "beginning", loose)
    monkeypatch.setattr(
        check_sections, "line_beginning", lambda *of: [x + 1e-3 for x in line_beginning(*of)]
    )
    low, high = sections.phases(numbers, line, [first])
    assert high - low > 1e-4
    theirs = check_sections.phases(problem, offered.line_of(line), offered.step(first))
    assert theirs.above - Fraction(theirs.low, 1 << check_series.DIGITS) > 1e-4


def test_phases_are_rounded_outward_in_words() -> None:
    """Also beside a number of nine decimals, where a product of doubles is that number."""
    lot = random.Random(1)
    for _ in range(300):
        end = lot.randrange(1, 6 * 10**9) / 1e9
        for low in (math.nextafter(end, 0), end, math.nextafter(end, 7)):
            said = sections.words_on_phases(low, low).split()
            assert Fraction(said[2]) <= Fraction(low) <= Fraction(said[4])
            assert Fraction(said[4]) - Fraction(said[2]) <= Fraction(1, 10**9)
            again = check_sections.words_on_phases(Interval.of(Fraction(low))).split()
            assert again[1::2] == said[2::2]


def test_a_config_of_both_energies_is_refused_by_the_second_checker_too() -> None:
    """Also where one of them is that of the proof; the package's schema refuses both."""
    found = check_full_shift.read(offered.STORED)
    problem = found.config["problem"]
    assert check_full_shift.energies_of(found) == {"shift": 0, "spread": 0}
    problem["h0"] = problem["h"]
    with pytest.raises(Refused, match="both h and h0"):
        check_full_shift.energies_of(found)
