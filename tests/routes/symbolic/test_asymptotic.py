"""Doubly asymptotic orbits: how many, symmetry, integration; their phases to 30 digits."""

import copy
import functools
import math
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics import floquet
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits import columns
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map import MapError
from rigidpend.routes.symbolic import asymptotic
from rigidpend.routes.symbolic import sharp as sharp_module
from rigidpend.routes.symbolic.asymptotic import DoublyAsymptotic, doubly_asymptotic, skeleton
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.levels import ChainLevel
from rigidpend.routes.symbolic.sharp import Launch, sharp
from rigidpend.surfaces.heteroclinic import increments
from tests.routes.symbolic.fig4 import BODY, HALF_TURNS, J1_0, H, launch, level, orbits, rough


@pytest.mark.slow
def test_all_orbits_are_found_and_by_a_coarser_grid_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as blind scans of 4,000 phases find; with few samples least |U| finds the rest."""
    assert [len(one.b) for one in rough(4)[2:]] == [22, 18, 104]
    expected = [len(one.b) for one in rough(4)[:4]]
    monkeypatch.setattr(asymptotic, "PER_CELL", 3)
    assert [len(one.b) for one, _ in skeleton(level(), 3, HALF_TURNS)] == expected


NEARLY_SYMMETRIC = Body(("1.6", "1.42", "1.5"), ("0.3", "0.7", 0), "0.004"), "1.1"
NEAR_HESS = Body((2, 1, "3/2"), (1, "1.41", 0), "0.001"), "1.3342"


@pytest.mark.parametrize(
    ("body", "h", "half_turns", "counts"),
    [
        # Here chi dips twice along an arc.
        (*NEARLY_SYMMETRIC, 148, [2, 2, 98]),
        # Here it dips once more near the end of an arc.
        (*NEARLY_SYMMETRIC, 147, [2, 0, 66]),
        # Arcs end at zeros of two half rotations more than are asked for, and here of ten.
        (*NEARLY_SYMMETRIC, 146, [2, 0, 42]),
        (*NEAR_HESS, 8, [2, 0, 2]),
    ],
)
def test_arcs_are_sampled_to_their_ends(
    body: Body, h: str, half_turns: int, counts: list[int]
) -> None:
    """As many orbits as a blind scan of 100,000 phases has found."""
    found = skeleton(ChainLevel.of(body, exact(h)), 2, half_turns)
    assert [len(one.b) for one, _ in found] == counts


def test_without_symbols_they_cross_at_gamma3_0_and_theta3_grows_as_integration_has_it() -> None:
    found, gained = orbits(0), increments(BODY, H, resolve()).gained[:, 1]
    np.testing.assert_allclose(np.sin(found.chain.chi[0]), 0, atol=1e-14)
    assert found.flight.tolist() == [0.0, 0.0]
    assert sorted(found.chain.cells[0] % 2) == [0, 1]
    np.testing.assert_allclose(np.sort(found.theta3), np.sort(gained), rtol=0, atol=1e-13)


def test_the_reversor_takes_heteroclinic_orbits_to_such() -> None:
    """Each has an image among those that are found, with its code read backward."""
    found = orbits(2)
    chi, d, turns = found.chain.chi, found.chain.d, np.diff(found.chain.cells, axis=0)
    away = np.exp(1j * chi)[:, :, None] - np.exp(-1j * chi[::-1])[:, None]
    image = np.abs(away).max(axis=0).argmin(axis=0)
    np.testing.assert_allclose(np.exp(1j * chi[:, image]), np.exp(-1j * chi[::-1]), atol=1e-9)
    np.testing.assert_allclose(d[:, image], d[::-1], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(found.symbols[:, image], 1 - found.symbols[::-1])
    np.testing.assert_array_equal(turns[:, image], turns[::-1])
    np.testing.assert_allclose(found.theta3[image], found.theta3, rtol=0, atol=1e-12)
    # Some codes are symmetric.
    assert 1 < (image == np.arange(len(image))).sum() < len(image)


def test_slopes_are_differences() -> None:
    """The slope of I = U V behind the last crossing, where U vanishes, against orbits beside."""
    found, step = orbits(2), 1e-7
    assert found.chain.residual.max() < 1e-13
    U = [asymptotic.track(level(), found.b + side * step, 2).U for side in (-1, 1)]
    slope = (U[1] - U[0]) / (2 * step) * found.V
    np.testing.assert_allclose(slope, found.I_slope, rtol=1e-5, atol=0)


LAST_DIGIT = Fraction(1, 10**29)


@pytest.mark.parametrize(
    "other",
    [
        {"DEPTH": Fraction(1, 3 * 10**18), "NEAREST": 3e-16},
        # As where a passage stretches more: the map's slopes err by more of themselves there.
        {"GAINED": 1e-13, "ROUNDS": 5},
    ],
)
def test_phases_depend_on_no_means(other: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    first = sharp(launch(), orbits(1))
    for name, value in other.items():
        monkeypatch.setattr(sharp_module, name, value)
    second = sharp(Launch(level(), J1_0), orbits(1))
    assert max(first.error.max(), second.error.max()) < sharp_module.FINEST_ERROR
    off = [abs(x - y) for x, y in zip(first.theta2_0, second.theta2_0, strict=True)]
    assert max(off) < LAST_DIGIT
    assert min(first.error.min(), second.error.min()) >= level().displaced(106), "no less is told"


HEAVY = Body(A=(3, "1.3", "2.2"), r=(3, 1, 0), mu="0.02"), exact("0.8"), 9
AS_FIG4 = {mu: (Body(BODY.A, BODY.r, mu), H, HALF_TURNS) for mu in ("1e-3", "1e-6")}


@pytest.mark.parametrize(
    ("of", "J1", "phases"),
    [
        # Starts come to J1_0 by the clock of the map, which must not err by mu J1_0.
        (HEAVY, "1e-6", ["2.745854586762325526185369847562", "5.918165835923858015438593339897"]),
        (HEAVY, "1e-3", ["1.374413265815075879820365419521", "4.514191009768489163323338018881"]),
        # The normal form has the terms that the layer needs, and tells such a J1_0 less well.
        (AS_FIG4["1e-3"], "0.2", ["3.56244502960246148766584800512059696"]),
        (AS_FIG4["1e-6"], "0.05", ["1.43696116742902984993171666293529839"]),
    ],
)
def test_phases_have_30_digits(of: tuple[Body, Any, int], J1: str, phases: list[str]) -> None:
    """As by another integrator, in 51 digits: to either side symbols differ, or gamma3 changes."""
    body, h, half_turns = of
    there = ChainLevel.of(body, h)
    [(rough, _)] = skeleton(there, 0, half_turns)
    found = sharp(Launch(there, exact(J1)), doubly_asymptotic(there, rough))
    for known in phases:
        assert min(abs(x - Fraction(known)) for x in found.theta2_0) < LAST_DIGIT
    assert max(found.error) < sharp_module.FINEST_ERROR


@pytest.mark.slow
def test_phases_of_a_thin_body_have_30_digits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its exponent keeps its digits, and starts keep theirs at any depth."""
    thin = ChainLevel.of(Body((1, "1e-6", "1 - 1e-6"), (1, 1, 0), "1e-10"), H)
    [(rough, _)] = skeleton(thin, 0, 8)
    found = []
    for depth in (sharp_module.DEPTH, Fraction(1, 3 * 10**18)):
        monkeypatch.setattr(sharp_module, "DEPTH", depth)
        found.append(sharp(Launch(thin, exact("1e-5")), doubly_asymptotic(thin, rough)))
    off = [abs(x - y) for x, y in zip(*(one.theta2_0 for one in found), strict=True)]
    assert max(off) < LAST_DIGIT
    assert max(max(one.error) for one in found) < sharp_module.FINEST_ERROR


def test_what_has_no_phases_is_refused() -> None:
    """Starts outside of the normal form, and a body whose surfaces doubles do not tell apart."""
    for J1 in ("0.5", "0.6", "1.41"):
        with pytest.raises(MapError, match=rf"J1_0 = {J1} lies outside of the normal form: take a"):
            sharp(Launch(level(), exact(J1)), orbits(0))
    flat = ChainLevel.of(Body(A=(2, "1.8", "1.96"), r=(1, 3, 0), mu="0.0005"), exact("1.6"))
    with pytest.raises(NoOrbit, match=r"-18\) that .* known only to 0\..* 0\.001 rad is needed"):
        skeleton(flat, 0, 1)


@functools.cache
def displaced() -> tuple[DoublyAsymptotic, DoublyAsymptotic]:
    """Orbits with one symbol where surfaces are split by 3e-14, with roundings of two kinds."""
    body = Body(A=("1.05", "0.92", 1), r=(1, 10, 0), mu="1e-5")
    little = ChainLevel.of(body, exact("0.25"))
    _, (rough, _) = skeleton(little, 1, 150)
    beside = rough._replace(b=rough.b + 1e-7, chi=rough.chi + 1e-6)
    return doubly_asymptotic(little, rough), doubly_asymptotic(little, beside)


def test_roundings_displace_chains_within_the_bound() -> None:
    """Newton's method ends in corrections of 1e-6 rad, and not in smaller ones."""
    one, other = displaced()
    moved = np.abs(one.chain.unknowns - other.chain.unknowns).max()
    assert len(one.b) == 10
    # Angles of 150 half rotations round to 6e-14.
    assert 1e-7 < moved < 60 * one.chain.level.displaced(53)
    assert one.chain.residual.max() < 3e-13


@pytest.mark.slow
def test_integration_tells_phases_and_times_where_the_map_is_displaced() -> None:
    found = [columns(x, np.array([0])) for x in displaced()]
    launches = [Launch(x.chain.level, J1_0) for x in found]
    assert (launches[0].bits, launch().bits) == (212, 106), "doubles of the map are displaced more"
    first, second = map(sharp, launches, found)
    assert first.error.max() < sharp_module.FINEST_ERROR
    assert abs(first.theta2_0[0] - second.theta2_0[0]) < LAST_DIGIT
    assert np.abs(found[0].flight - found[1].flight).max() > 1e-9
    np.testing.assert_allclose(first.flight, second.flight, rtol=1e-15)


@pytest.mark.slow
def test_homoclinic_orbits_tend_to_the_periodic_orbit_at_the_floquet_rate() -> None:
    """In 113 bits, both ways, over eight periods; what is left is of third order in distance."""
    found, one, exactly = orbits(3), launch(), np.frompyfunc(Fraction, 1, 1)
    starts, rate = sharp(one, found).starts, floquet.periodic_orbit(BODY.angles(), float(H))
    begun = found.begun - one.clock(found.b, float(one.J1))
    far = rate.period * np.arange(4.0, 12.0)[:, None] + 0 * begun
    crossing = states_at(one.fractions, starts, exactly(begun[None]), 113)[:, 0]
    # The reversor: what it does in time is what the orbit did before.
    back = crossing * np.array([[1], [1], [-1], [1], [1], [-1]])
    for states, times in ((starts, begun + found.flight + far), (back, far)):
        seen = states_at(one.fractions, states[:, :2], exactly(times[:, :2]), 113).astype(float)
        distance = np.hypot(seen[0], seen[1])
        off = np.abs(np.diff(np.log(distance), axis=0) + rate.exponent_per_period)
        assert distance[0].max() < 1e-2
        assert (off < 2 * distance[:-1] ** 2 + 1e-12).all()


def test_orbits_that_doubles_do_not_tell_apart_are_refused_and_found_as_the_remedy_says() -> None:
    thin = ChainLevel.of(Body(A=BODY.A, r=BODY.r, mu="1e-12"), exact(H))
    for n, symbols in ((48, 1), (100, 1), (48, 2)):
        with pytest.raises(NoOrbit, match=r"allow 47 at most, or fewer symbols$"):
            skeleton(thin, symbols, n)
    # Each half rotation more is two more places where a symbol may end, on both sides.
    found = [len(skeleton(thin, 1, n)[1][0].b) for n in (30, 31, 47)]
    assert found == [6, 10, 74]
    with pytest.raises(NoOrbit, match="allow fewer half rotations of its passages, or fewer sym"):
        doubly_asymptotic(thin, skeleton(thin, 2, 40)[2][0])
    assert len(doubly_asymptotic(thin, skeleton(thin, 2, 36)[2][0]).b) > 100


def test_an_orbit_that_is_elsewhere_or_not_told_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    found = orbits(1)
    with pytest.raises(NoOrbit, match="rad from where the map has it"):
        sharp(launch(), found._replace(chain=found.chain._replace(parameter=found.b + 1e-9)))
    # Where it should end it has left again.
    with pytest.raises(NoOrbit, match="leaves the periodic orbit before its end"):
        sharp(launch(), found._replace(V=1e12 * found.V))
    monkeypatch.setattr(sharp_module, "ROUNDS", 1)
    with pytest.raises(NoOrbit, match=r"theta2_0 does not settle below \d\S*e-1\d rad"):
        sharp(launch(), found)
    monkeypatch.setattr(asymptotic, "track", lambda *_: SimpleNamespace(U=np.ones(721)))
    with pytest.raises(NoOrbit, match="the asymptotic surfaces do not cross"):
        skeleton(level(), 0, HALF_TURNS)


def test_a_track_that_doubles_do_not_place_is_refused_with_that_reason() -> None:
    """Some orbits with two symbols change sides at downward crossings, those with one do not."""
    near, (_, (one, _), (two, _)) = copy.copy(level()), skeleton(level(), 2, 12)
    near.downward_splitting = math.ldexp(near.widest_d, -43)
    with pytest.raises(NoOrbit, match=r"at the Hess case or near it: .* at downward crossings"):
        doubly_asymptotic(near, two._replace(b=two.b + 0.01))
    with pytest.raises(NoOrbit, match="elsewhere"):
        doubly_asymptotic(near, one._replace(b=one.b + 0.01))


@pytest.mark.slow
def test_steps_that_integration_does_not_tell_tell_no_slopes() -> None:
    """Near the Hess case some settle first; by a Taylor series of Euler-Poisson in 220 bits."""
    body = Body(A=(2, 1, "3/2"), r=(1, "1.4", 0), mu="0.001")
    near = ChainLevel.of(body, H)
    three = doubly_asymptotic(near, skeleton(near, 3, 14)[3][0])
    found = sharp(Launch(near, J1_0), three)
    assert found.error.max() < sharp_module.FINEST_ERROR
    phase = Fraction("1.39967732549086038606770883518449")
    assert min(abs(each - phase) for each in found.theta2_0) < found.error.max()
