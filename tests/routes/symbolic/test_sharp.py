"""Phases to 30 digits: other starts and ends, and orbits followed in 113 bits."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics import floquet
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import fraction
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.symbolic import sharp as module
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.sharp import Launch, carried, sharp
from tests.routes.symbolic.fig4 import (
    BODY,
    J1_0,
    H,
    launch,
    level,
    orbits,
)

LAST_DIGIT = Fraction(1, 10**29)


def test_phases_do_not_depend_on_where_orbits_begin_and_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first = sharp(launch(), orbits(1)).theta2_0
    monkeypatch.setattr(module, "DEPTH", Fraction(1, 3 * 10**18))
    monkeypatch.setattr(module, "NEAREST", 4e-10)
    second = sharp(Launch(BODY, level(), H, J1_0), orbits(1)).theta2_0
    for one, other in zip(first, second, strict=True):
        assert abs(one - other) < LAST_DIGIT


def test_the_map_is_confirmed_to_its_rounding() -> None:
    found = sharp(launch(), orbits(2))
    assert np.abs(found.moved).max() < 2e-13
    assert found.error.max() < 3e-30


def test_orbits_in_106_bits_are_those_in_113() -> None:
    """Two engines: pairs of doubles, and quadruple precision."""
    starts = sharp(launch(), orbits(0)).starts
    times = np.array([20.0, 31.5])
    found = carried(launch().fractions, starts, times).T
    for k in range(2):
        there = one_at(launch().fractions, starts[k], [Fraction(times[k])])[0]
        # Times are met to the rounding of doubles: compared along the orbit, by what is kept.
        for pair in ((found[k], there),):
            energies = [energy(state) for state in pair]
            assert abs(energies[0] - energies[1]) < Fraction(1, 10**29)
        assert max(abs(float(x - y)) for x, y in zip(found[k], there, strict=True)) < 1e-14


def energy(state: list[Fraction]) -> Fraction:
    """kappa J2^2/2 - Qp Qm/2 + mu r . gamma, exact."""
    c, wide = launch().fractions, launch().c
    to_M1, to_M2 = (fraction(x, 200) for x in (wide.to_M1, wide.to_M2))
    Qp, Qm, M3, gamma1, gamma2, _ = state
    M1, M2 = (Qp + Qm) * to_M1, (Qp - Qm) * to_M2
    square = M1 * M1 + M2 * M2 + M3 * M3
    return c.kappa / 2 * square - Qp * Qm / 2 + c.mu_r1 * gamma1 + c.mu_r2 * gamma2


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 3])
def test_homoclinic_orbits_tend_to_the_periodic_orbit_at_the_floquet_rate(n: int) -> None:
    """In 113 bits, forward and backward from the first crossing, over eight periods each.

    Beside the orbit what is left is of third order, relative 1e-6 at a distance of 1e-3.
    """
    found, one = orbits(n), launch()
    starts = sharp(one, found).starts
    rate = floquet.periodic_orbit(BODY.angles(), float(H))
    begun = found.begun(level()) - one.clock(one.theta2(found.b, float(one.J1)), float(one.J1))
    far = 4.0 * rate.period
    for k in (0, 1):
        end = float((begun + found.flight)[k])
        check(one.fractions, starts[k], end + far, rate, 8)
        [crossing] = one_at(one.fractions, starts[k], [Fraction(float(begun[k]))])
        back = [reversed_state(crossing)]
        check(one.fractions, back[0], far, rate, 8)


def one_at(c: AlignedCoefficients, state: list[Fraction], times: list[Fraction]) -> Any:
    """An orbit at times, (k, 6), in 113 bits."""
    return states_at(c, np.array([state]).T, times, 113)[..., 0].T


def reversed_state(state: list[Fraction]) -> list[Fraction]:
    """The reversor: what it does in time is what the orbit did before."""
    Qp, Qm, M3, gamma1, gamma2, gamma3 = state
    return [Qp, Qm, -M3, gamma1, gamma2, -gamma3]


def check(
    c: AlignedCoefficients,
    start: list[Fraction],
    begin: float,
    rate: floquet.PeriodicOrbit,
    periods: int,
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
        sharp(launch(), found._replace(b=found.b + 1e-9))
