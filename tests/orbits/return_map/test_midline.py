"""Midlines against the surfaces as integration finds them, and maps that count d from them."""

import math
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import context, exact
from rigidpend.orbits.integrate.states import first_crossings, states_at
from rigidpend.orbits.precision import in_triples, precision, rounded
from rigidpend.orbits.return_map import MapError, ReturnMap, build, looks, return_map, storage
from rigidpend.orbits.return_map.build import FIRST, SECOND, Design
from rigidpend.orbits.return_map.charts import Arcs, arc_ends
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import Interval, fourier_basis
from rigidpend.orbits.return_map.looks import Rough, midlines
from rigidpend.orbits.return_map.midline import Layer, Midline, midline
from rigidpend.orbits.return_map.normal_form import normal_form
from rigidpend.orbits.return_map.orders import building_seconds
from rigidpend.orbits.return_map.passage import SectionPoint
from rigidpend.orbits.return_map.poincare import section_point, section_state
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.surfaces import surface_orbits
from tests.bodies import FIG4
from tests.orbits.integrate.problems import by

DOUBLES, FINE, M = precision(53), precision(200), context(200)
DEEP = Body(("1.534", "1.296", "1.440"), ("0.983", "0.184", 0), "0.000179")
"""A body drawn by lot with nu = 19: the layer is 2^12 times narrower than the displacement."""
NARROWER, H = 12, "1.0882"
ENDS = exact("1.088"), exact("1.0884")
VALUES = np.array([[3.0, -2e-3, 5e-6, 0.0], [1e-3, 4e-6, 0.0, 1.1e-9], [0.9e-9, 0.0, 0.0, 0.0]])
SIDES = pytest.mark.parametrize("rising", [False, True], ids=["downward", "upward"])


def rough(body: Body, h: str) -> Rough:
    return Rough(coefficients(body.angles(), "1", DOUBLES), float(h))


def line(values: Any, x: Any, chi: Any) -> Any:
    """A midline at a share x of the interval of energies, by cosines in 200 bits."""
    return M.fsum(
        v * M.cos(e * M.acos(x)) * M.cos(k * chi) for (e, k), v in np.ndenumerate(values) if v
    )


def test_a_midline_is_the_even_part_of_a_surface_without_its_smallest_terms() -> None:
    """Terms of 1e-9 and more; orders and harmonics behind the last of them are left out."""
    x, chi = np.cos(np.pi * (np.arange(6) + 0.5) / 6), 2 * np.pi * np.arange(13) / 13
    energies = np.cos(np.arange(3) * np.arccos(x[:, None]))
    odd = 0.3 * np.sin(chi) + 0.01 * x[:, None] * np.sin(2 * chi)
    surface = energies @ VALUES @ np.cos(np.arange(4)[:, None] * chi)
    found = midline(surface + odd, 1e-9)
    expected = VALUES[:2]
    assert found.values.shape == expected.shape
    np.testing.assert_allclose(found.values, expected, rtol=0, atol=5e-15)
    assert (found.values[expected == 0] == 0).all()
    np.testing.assert_allclose(midline(surface + odd, 0.8e-9).values, VALUES, rtol=0, atol=5e-15)
    np.testing.assert_array_equal(midline(odd, 1e-9).values, [[0.0]])


def test_a_midline_in_another_unit_and_in_the_middle_of_the_energies() -> None:
    own = Midline(VALUES)
    np.testing.assert_array_equal(own.in_unit(0.25).values, VALUES / 4)
    # There the first of three polynomials is 1, the second 0 and the third -1.
    np.testing.assert_array_equal(own.middle().values, VALUES[:1] - VALUES[2:])


@pytest.mark.parametrize("a", [precision(160), in_triples(148), precision(96), DOUBLES])
def test_midlines_are_cosines_times_polynomials_in_every_arithmetic(a: Any) -> None:
    """Two points at one energy and three at another."""
    sizes, x, chi = [2, 3], [0.625, -1.0], [0.5, 3.0, 1.25, -2.0, 6.0]
    energies = Interval(a.number(1.25), a.number(0.03125), 9)
    h = a.array([1.25 + 0.03125 * share for share in x])
    found = Midline(VALUES).at(a.cos(a.array(chi)), h, sizes, energies, a)
    for one, share, phase in zip(found, np.repeat(x, sizes), chi, strict=True):
        true = M.mpf(0) + (exact_of(one) if a is not DOUBLES else float(one))
        assert abs(true - line(VALUES, share, M.mpf(phase))) < 40 * a.epsilon


def exact_of(x: Any) -> Any:
    return M.mpf(x) if not hasattr(x, "exactly") else sum(map(M.mpf, x.parts.tolist()))


def surface(body: Body, h: str, rising: bool) -> tuple[Any, Any]:
    """Points d and chi of a surface on the section, from the lower periodic orbit in doubles.

    The surface beside separatrix 1 is the mirror image of that beside 2 of another body.
    """
    s = surface_orbits.surface(body, exact(h), 53, 2 if rising else 1)
    theta2 = surface_orbits.guarded(53).array(np.linspace(0, 2 * math.pi, 32, endpoint=False))
    begin = surface_orbits.launches(s, theta2, 73 * math.log(2), surface_orbits.guarded(53))
    c = AlignedCoefficients(*map(float, surface_orbits.coefficients(s)))
    found = first_crossings(c, begin.astype(float), 200.0, **by("taylor", 53))
    assert found is not None
    _, state = found
    if not rising:
        Qp, Qm, M3, *gamma = state
        state = np.stack((-Qm, -Qp, -M3, gamma[0], -gamma[1], gamma[2]))
    d, chi, _ = section_point(rising, state, rough(body, h).c, DOUBLES)
    return d, chi


@SIDES
@pytest.mark.parametrize(("body", "h"), [(FIG4, "1.3342"), (DEEP, H)], ids=["Fig. 4", "deep"])
def test_agrees_a_midline_with_the_even_part_of_the_surface(
    body: Body, h: str, rising: bool
) -> None:
    """Up to what is left out, and to roundings of the displacement."""
    looked = rough(body, h)
    size = looked.displacement
    least = 1e-12 * size
    own = midlines(looked, 0.0, least)[rising].values[0]
    d, chi = surface(body, h, rising)
    series = np.linalg.lstsq(fourier_basis(chi, 25, DOUBLES), d, rcond=None)[0]
    even = series[[0, *range(1, 25, 2)]]
    assert np.abs(even[: len(own)] - own).max() < 5e-14 * size
    assert np.abs(even[len(own) :]).max() < least < np.abs(even[: len(own)]).min()
    # Between energies too, not at a node of six.
    wide = midlines(rough(body, h), 0.001, least)[rising]
    d, chi = surface(body, str(float(h) + 0.0004), rising)
    energies, at = Interval(float(h), 0.001, 1), np.array([float(h) + 0.0004])
    middle = wide.at(np.cos(chi), at, [len(chi)], energies, DOUBLES)
    odd = np.linalg.lstsq(fourier_basis(chi, 25, DOUBLES), d - middle, rcond=None)[0]
    assert np.abs(odd[[0, *range(1, 25, 2)]]).max() < 2 * least
    assert np.abs(odd).max() > 1e-8 * size


def test_the_displacement_is_estimated_to_a_quarter() -> None:
    """On the section where it is larger; without the turning force's factor it is 4 or 19 times."""
    for body, h in ((FIG4, "1.3342"), (DEEP, H)):
        looked = rough(body, h)
        lines = midlines(looked, 0.0, 1e-12 * looked.displacement)
        found = max(np.abs(line.values[0]).sum() for line in lines)
        assert looked.displacement == pytest.approx(found, rel=0.25)


@pytest.mark.parametrize(
    ("least", "steps", "found"),
    [(1e-8, 5, True), (1e-8, 4, False), (1e-12, 6, True), (1e-12, 5, False), (1e-15, 7, True)],
)
def test_surfaces_are_found_by_as_many_secants_as_that_takes_or_there_is_no_midline(
    least: float, steps: int, found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each about adds the digits of the two before it, until both values are the same."""
    looked = rough(DEEP, H)
    monkeypatch.setattr(looks, "MIDLINE_STEPS", steps)
    if found:
        midlines(looked, 0.0, least * looked.displacement)
    else:
        with pytest.raises(MapError, match="displacement is not found in doubles"):
            midlines(looked, 0.0, least * looked.displacement)


@pytest.fixture(scope="module")
def narrow() -> ReturnMap:
    return return_map(DEEP, h=ENDS, bits=64, design=FIRST._replace(narrower=NARROWER))


@SIDES
def test_a_layer_beside_midlines_holds_both_surfaces(narrow: ReturnMap, rising: bool) -> None:
    """It is narrower by the bits it was asked for, and the terms left out are a share of it."""
    width = float(narrow.charts[rising].forward.width)
    d, chi = surface(DEEP, "1.0883", rising)
    energies, h = Interval(1.0882, 0.0002, 1), np.array([1.0883])
    off = np.abs(d - narrow.midlines[rising].at(np.cos(chi), h, [len(d)], energies, DOUBLES))
    assert off.max() < looks.TRIM * width
    assert looks.MARGIN * 9 / 8 < width / np.abs(d).max() * 2**NARROWER < 2


def counted(values: Any, d: Any, chi: Any) -> Any:
    """What d from a midline is from zero, at the energy 1.0883 halfway to the interval's end."""
    return FINE.array(d) + np.array([line(values, M.mpf(0.5), x) for x in FINE.array(chi)])


@SIDES
@pytest.mark.parametrize("design", [FIRST, SECOND], ids=["1", "1.37"])
def test_agrees_a_narrow_map_with_one_that_does_without_midlines(
    design: Design, rising: bool
) -> None:
    """Passages of both are the same but for their stated errors, in any unit of M."""
    whole = return_map(DEEP, h=ENDS, bits=84, design=FIRST)
    narrow = return_map(DEEP, h=ENDS, bits=64, design=design._replace(narrower=NARROWER))
    unit, n, random = FINE.number(exact(design.unit)), 24, np.random.default_rng(8 + rising)
    width, chi = float(narrow.charts[rising].forward.width), random.uniform(0, 6.28, n)
    d = random.uniform(-0.9, 0.9, n) * width
    own = narrow.at("1.0883").passage(SectionPoint(rising, *map(precision(64).array, (d, chi))))
    at = counted(narrow.midlines[rising].values, d, chi) / unit
    there = SectionPoint(rising, *map(precision(84).array, (at, chi)))
    other = whole.at("1.0883").passage(there, slopes=True)
    inside = own.inside & other.inside
    assert inside.sum() > n / 2
    assert (own.symbol == other.symbol)[inside].all()
    # At one chi: where the other ends the midline is steep beside the layer.
    off = [
        (
            counted(narrow.midlines[not rising].values, own.point.d, other.point.chi) / unit
            - FINE.array(other.point.d)
        )
        / width,
        FINE.array(own.turned) - FINE.array(other.turned),
        FINE.array(own.time) * unit - FINE.array(other.time),
    ]
    grown = 1 + np.abs(precision(84).floats(other.slopes)).max(axis=(0, 1)) * width
    allowed = narrow.errors.largest + whole.errors.largest * 2**NARROWER
    assert allowed < 1e-22
    for each in off:
        assert (np.abs(FINE.floats(each)) < allowed * grown)[inside].all()


@SIDES
@pytest.mark.parametrize(("design", "bits"), [(FIRST, 80), (SECOND, 64), (FIRST, 53)])
def test_states_are_placed_beside_the_midline_with_all_digits_of_a_map(
    design: Design, bits: int, rising: bool
) -> None:
    """States are made in 200 bits; doubles would lose twelve bits or more beside the midline."""
    made = return_map(DEEP, h=ENDS, bits=bits, design=design._replace(narrower=NARROWER))
    unit, width = FINE.number(exact(design.unit)), made.charts[rising].forward.width
    chi, share = np.array([0.4, 2.9, 5.5, -1.0]), np.array([0.3, -0.9, 1e-4, 0.7])
    d = counted(made.midlines[rising].values, FINE.array(share) * FINE.array(width), chi)
    c = coefficients(DEEP.angles(232), design.unit, FINE)
    h = FINE.number(exact("1.0883")) * unit * unit
    states = section_state(rising, d, FINE.array(chi), h, c, FINE)
    # The images beside separatrices 4 and 1 have M1, M2 and gamma3 of the other sign.
    states[:, 1] = states[:, 1] * np.array([-1, -1, 1, 1, 1, -1])
    x, phase, side = made.placed(rising, states, np.full(4, 0.5))
    assert np.abs(FINE.floats(FINE.array(x) - share)).max() < 2.0 ** (2 - bits)
    turned = (FINE.array(phase) - chi) / (2 * FINE.pi)
    turned = FINE.floats(turned - np.round(FINE.floats(turned)))
    assert np.abs(turned).max() < 2.0 ** (2 - bits)
    np.testing.assert_array_equal(side, [1, -1, 1, 1])


def test_a_narrow_map_is_kept_with_its_midlines_apart_from_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    storage.kept_map.cache_clear()
    design = FIRST._replace(narrower=NARROWER)
    made = return_map(DEEP, h=ENDS, design=design)
    storage.kept_map.cache_clear()
    monkeypatch.setattr(storage, "build", lambda *_: pytest.fail("built again"))
    again = return_map(DEEP, h=ENDS, design=design)
    assert again is not made
    assert (again.design, again.errors) == (design, made.errors)
    for one, other in zip(again.midlines, made.midlines, strict=True):
        np.testing.assert_array_equal(one.values, other.values)
        assert other.values.any()
    one, other = (x.program(53, 1e-6, 1e-5).values for x in (made, again))
    np.testing.assert_array_equal(one, other)
    others = [design, design._replace(narrower=NARROWER - 1), FIRST]
    assert [storage.is_kept(DEEP, *ENDS, 53, x) for x in others] == [True, False, False]


@pytest.mark.parametrize(
    ("bits", "narrower", "width", "arcs"),
    [
        (64, 1, 26.0, (96, 2)),
        (64, 1, 26.1, (107, 3)),
        (64, 1, 54.1, (125, 3)),
        (90, 1, 0.1, (107, 3)),
        (90, 1, -1.0, (95, 2)),
        (64, 0, 60.0, (70, 2)),
    ],
)
def test_arcs_have_the_bits_of_tables_and_those_by_which_the_layer_is_thinner_than_one(
    bits: int, narrower: int, width: float, arcs: tuple[int, int], monkeypatch: Any
) -> None:
    monkeypatch.setattr(build, "building_seconds", lambda *_, **__: 0.0)
    monkeypatch.setattr(build, "Arcs", asked := Mock(side_effect=InterruptedError))
    layer, given = Layer(1.0, (2.0**-width, 2.0 ** (1 - width))), Mock(n_energy=1, length=5.0)
    with pytest.raises(InterruptedError):
        build.build(DEEP, *ENDS, bits, FIRST._replace(narrower=narrower), by=(layer, given))
    a = asked.call_args.args[2]
    assert (a.bits, a.parts) == arcs


def test_terms_beside_a_midline_suffice_at_the_first_attempt_and_with_fewer_bits_do_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    body = Body(("2.598", "1.762", "2.518"), ("0.775", "0.632", 0), "0.00138")
    ends = exact("1.27142"), exact("1.27418")
    monkeypatch.setattr(build, "ATTEMPTS", 1)
    design = FIRST._replace(narrower=7)
    assert build.build(body, *ends, 82, design).errors.largest < 2.0**-82 / 8
    monkeypatch.setattr(build, "NARROW_BITS", 0)
    with pytest.raises(MapError, match="don't settle"):
        build.build(body, *ends, 82, design)


def test_a_narrow_map_is_expected_to_cost_what_arcs_in_triples_do() -> None:
    """Tables of 82 bits, of a layer of 2^-26.04; those of 59 bits begin arcs in pairs."""
    design = FIRST._replace(narrower=NARROWER)
    for bits, tables, triples in ((76, 82, True), (53, 59, False)):
        _, planned = build.plan(DEEP, *ENDS, bits, design)
        given = rough(DEEP, H), planned, precision(tables)
        costs = [building_seconds(*given, x, theta3=False) for x in (given[2], in_triples(109))]
        assert costs[0] < costs[1] < building_seconds(*given, in_triples(110), theta3=False)
        assert build.expected_cost(DEEP, *ENDS, bits, design) == costs[triples]


@SIDES
def test_arcs_run_with_all_digits_of_the_sums_in_which_they_begin(rising: bool) -> None:
    """Coefficients in pairs would leave 2^-104; states at the end are rounded to pairs."""
    body, a, sharp = Body((2, 1, "1.5"), (1, 1, 0), "1e-12"), precision(96), in_triples(148)
    h, length = exact(H), 20 * math.log(2) / rough(body, H).rate
    c, fine = (coefficients(body.angles(240), "1", x) for x in (sharp, FINE))
    nf = normal_form(rounded(c, a), Interval(a.number(h), a.number(0), 1), 3, 5, 0.1, a)
    form, arcs = TorusForm(nf, nf.energies.nodes(a), a), Arcs(a.number(length), c, sharp)
    d, chi = [1e-13], [0.5]
    path, time, *_ = arc_ends(rising, a.array(d), a.array(chi), form, arcs, a.zeros((0,)))
    begin = section_state(rising, FINE.array(d), FINE.array(chi), FINE.array(form.h), fine, FINE)
    true = states_at(fine.aligned, begin, FINE.array(time)[None], 200)[:, 0]
    assert FINE.largest(FINE.array(path[:, -1]) - true) < 2.0**-106
