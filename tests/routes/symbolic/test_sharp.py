"""Phases to 30 digits: other starts and ends, and orbits followed in 113 bits."""

from __future__ import annotations

import functools
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics import floquet
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.records import columns
from rigidpend.routes.symbolic import sharp as module
from rigidpend.routes.symbolic.asymptotic import DoublyAsymptotic, doubly_asymptotic, skeleton
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.levels import Level
from rigidpend.routes.symbolic.sharp import Launch, sharp
from tests.routes.symbolic.fig4 import BODY, J1_0, H, launch, level, orbits

LAST_DIGIT = Fraction(1, 10**29)


def test_phases_do_not_depend_on_where_orbits_begin_and_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first = sharp(launch(), orbits(1)).theta2_0
    monkeypatch.setattr(module, "DEPTH", Fraction(1, 3 * 10**18))
    monkeypatch.setattr(module, "NEAREST", 3e-16)
    second = sharp(Launch(level(), J1_0), orbits(1)).theta2_0
    for one, other in zip(first, second, strict=True):
        assert abs(one - other) < LAST_DIGIT


@pytest.mark.slow
def test_where_surfaces_are_split_little_more_bits_serve(monkeypatch: pytest.MonkeyPatch) -> None:
    """In 106 bits roundings displace these orbits by 1e-23 rad, in doubles by 5e-9."""
    body = Body(A=(2, "1.607", "1.645"), r=("0.118", "0.993", 0), mu="0.0155")
    little = Level.of(body, exact("1.015"))
    two = doubly_asymptotic(little, skeleton(little, 0, 1)[0][0])
    first = Launch(little, J1_0)
    assert (first.bits, launch().bits) == (212, 106)
    found = sharp(first, two)
    monkeypatch.setattr(module, "NEAREST", 1e-20)
    monkeypatch.setattr(module, "DEPTH", module.DEPTH / 1000)
    monkeypatch.setattr(module, "HIGHEST", module.HIGHEST / 1000)
    other = sharp(Launch(little, J1_0), two)
    assert (found.error < module.FINEST).all()
    off = [abs(x - y) for x, y in zip(found.theta2_0, other.theta2_0, strict=True)]
    assert (np.array(off) < found.error).all()
    assert np.abs(found.moved).max() > 10 * module.FIRST_ERROR


@functools.cache
def displaced() -> tuple[DoublyAsymptotic, DoublyAsymptotic]:
    """Orbits with one symbol where surfaces are split by 3e-14, with roundings of two kinds."""
    body = Body(A=("1.05", "0.92", 1), r=(1, 10, 0), mu="1e-5")
    little = Level.of(body, exact("0.25"))
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
    first, second = (sharp(Launch(x.chain.level, J1_0), x) for x in found)
    assert first.error.max() < module.FINEST
    assert abs(first.theta2_0[0] - second.theta2_0[0]) < LAST_DIGIT
    assert np.abs(found[0].flight - found[1].flight).max() > 1e-9
    np.testing.assert_allclose(first.flight, second.flight, rtol=1e-15)


def test_a_body_whose_surfaces_doubles_do_not_tell_apart_is_refused() -> None:
    flat = Level.of(Body(A=(2, "1.8", "1.96"), r=(1, 3, 0), mu="0.0005"), exact("1.6"))
    with pytest.raises(NoOrbit, match="-18 only, and doubles place an orbit on them within 0"):
        skeleton(flat, 0, 1)


def test_a_correction_may_gain_less_than_expected(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where a passage stretches more: the map's slopes err by more of themselves there."""
    monkeypatch.setattr(module, "ROUNDS", 5)
    with_all = sharp(launch(), orbits(1))
    monkeypatch.setattr(module, "GAINED", 1e-13)
    found = sharp(launch(), orbits(1))
    assert found.error.max() < module.FINEST
    for one, other in zip(with_all.theta2_0, found.theta2_0, strict=True):
        assert abs(one - other) < LAST_DIGIT


def test_the_map_is_confirmed_to_its_rounding() -> None:
    found = sharp(launch(), orbits(2))
    assert np.abs(found.moved).max() < 2e-13
    assert found.error.max() < 3e-30


@pytest.mark.slow
def test_homoclinic_orbits_tend_to_the_periodic_orbit_at_the_floquet_rate() -> None:
    """In 113 bits, forward and backward from the first crossing, over eight periods each.

    Beside the orbit what is left is of third order, relative 1e-6 at a distance of 1e-3.
    """
    found, one = orbits(3), launch()
    starts = sharp(one, found).starts.T
    rate = floquet.periodic_orbit(BODY.angles(), float(H))
    begun = found.begun - one.clock(found.b, float(one.J1))
    far = 4.0 * rate.period
    for k in (0, 1):
        end = float((begun + found.flight)[k])
        check(one.fractions, starts[k], end + far, rate)
        [crossing] = one_at(one.fractions, starts[k], [Fraction(float(begun[k]))])
        # The reversor: what it does in time is what the orbit did before.
        back = [x * sign for x, sign in zip(crossing, (1, 1, -1, 1, 1, -1), strict=True)]
        check(one.fractions, back, far, rate)


def one_at(c: AlignedCoefficients, state: list[Fraction], times: list[Fraction]) -> Any:
    """An orbit at times, (k, 6), in 113 bits."""
    return states_at(c, np.array([state]).T, times, 113)[..., 0].T


def check(
    c: AlignedCoefficients,
    start: list[Fraction],
    begin: float,
    rate: floquet.PeriodicOrbit,
    periods: int = 8,
) -> None:
    """That the distance from the periodic orbit shrinks by the multiplier in every period."""
    times = [Fraction(begin + k * rate.period) for k in range(periods)]
    states = one_at(c, start, times).astype(float)
    distance = np.hypot(states[:, 0], states[:, 1])
    assert distance[0] < 1e-2
    shrunk = -np.diff(np.log(distance))
    off = np.abs(shrunk - rate.exponent_per_period)
    assert (off < 2 * distance[:-1] ** 2 + 1e-12).all()
    assert distance[-1] < math.exp(-0.99 * (periods - 1) * rate.exponent_per_period) * distance[0]


def test_an_orbit_that_is_elsewhere_is_refused() -> None:
    found = orbits(1)
    with pytest.raises(NoOrbit, match="rad from where the map has it"):
        sharp(launch(), found._replace(chain=found.chain._replace(unknown=found.b + 1e-9)))


@pytest.mark.slow
def test_steps_that_integration_does_not_tell_tell_no_slopes() -> None:
    """Orbits of which some settle in a round before others, with r nearly that of the Hess case.

    The phase is one between two from which the next symbol differs, by a Taylor series of
    Euler-Poisson in body axes in 220 bits.
    """
    body = Body(A=(2, 1, "3/2"), r=(1, "1.4", 0), mu="0.001")
    near = Level.of(body, H)
    three = doubly_asymptotic(near, skeleton(near, 3, 14)[3][0])
    found = sharp(Launch(near, J1_0), three)
    assert found.error.max() < module.FINEST
    phase = Fraction("1.39967732549086038606770883518449")
    assert min(abs(each - phase) for each in found.theta2_0) < found.error.max()
