"""Doubly asymptotic orbits: the skeleton against blind scans, symmetry, theta3, the map itself."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.symbolic import asymptotic
from rigidpend.routes.symbolic.asymptotic import doubly_asymptotic, skeleton, track
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.levels import Level
from rigidpend.surfaces.heteroclinic import increments
from tests.routes.symbolic.fig4 import BODY, HALF_TURNS, H, level, orbits, rough


def scanned(low: float, high: float, count: int, n: int, half_turns: int) -> Array:
    """Middles between evenly spaced b at which U changes its sign behind n passages."""
    b = np.linspace(low, high, count)
    seen = track(level(), b, n)
    changed = np.signbit(seen.U[1:]) != np.signbit(seen.U[:-1])
    known = seen.inside[1:] & seen.inside[:-1]
    middle = (b[1:] + b[:-1]) / 2
    at = np.flatnonzero(changed & known)
    # The cells of the zero itself, for beside a border those of a sample are others.
    few = (track(level(), middle[at], n).half_turns <= half_turns).all(axis=0)
    return np.asarray(middle[at[few]])


@pytest.mark.slow
@pytest.mark.parametrize(("n", "count"), [(2, 22), (3, 18), (4, 104)])
def test_a_blind_scan_of_windows_finds_the_same_orbits(n: int, count: int) -> None:
    """Windows in the densest parts, where arcs turn back and zeros end in pairs."""
    b = np.sort(np.mod(rough(4)[n].b, 2 * np.pi))
    assert len(b) == count
    gaps = np.diff(b)
    for k in np.argsort(gaps)[[0, len(gaps) // 8]]:
        low, high = max(0.0, b[k] - 13 * gaps[k]), min(b[k] + 40 * gaps[k], 2 * np.pi)
        inside = b[(b > low) & (b < high)]
        blind = scanned(low, high, 4_000, n, HALF_TURNS)
        assert inside.size >= 2
        np.testing.assert_allclose(blind, inside, rtol=0, atol=(high - low) / 4_000)


@pytest.mark.slow
def test_a_coarser_grid_finds_as_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """With three samples a half rotation many pairs lie between samples: least |U| finds them."""
    expected = [len(one.b) for one in rough(4)[:4]]
    monkeypatch.setattr(asymptotic, "PER_CELL", 3)
    assert [len(one.b) for one, _ in skeleton(level(), 3, HALF_TURNS)] == expected


def test_without_symbols_they_cross_at_gamma3_0() -> None:
    found = orbits(0)
    np.testing.assert_allclose(np.sin(found.chain.chi[0]), 0, atol=1e-14)
    assert found.flight.tolist() == [0.0, 0.0]
    assert sorted(found.chain.cells[0] % 2) == [0, 1]


def test_theta3_grows_as_integration_has_it() -> None:
    gained = increments(BODY, H, resolve()).gained[:, 1]
    np.testing.assert_allclose(np.sort(orbits(0).theta3), np.sort(gained), rtol=0, atol=1e-13)


def test_the_reversor_takes_heteroclinic_orbits_to_such_and_symmetric_codes_to_themselves() -> None:
    n = 2
    found = orbits(n)
    chi, d, turns = found.chain.chi, found.chain.d, np.diff(found.chain.cells, axis=0)
    symmetric = 0
    for k in range(len(found.b)):
        away = np.abs(np.exp(1j * chi) - np.exp(-1j * chi[::-1, k : k + 1]))
        image = int(np.argmin(away.max(axis=0)))
        assert away[:, image].max() < 1e-9
        np.testing.assert_allclose(d[:, image], d[::-1, k], rtol=0, atol=1e-12)
        np.testing.assert_array_equal(found.symbols[:, image], 1 - found.symbols[::-1, k])
        np.testing.assert_array_equal(turns[:, image], turns[::-1, k])
        np.testing.assert_allclose(found.theta3[image], found.theta3[k], rtol=0, atol=1e-12)
        if image == k:
            symmetric += 1
            assert abs(np.sin(chi[n // 2, k])) < 1e-11
        else:
            # No other orbit with a symmetric code and the same half rotations.
            same = (found.symbols[:, k] == found.symbols[:, image]).all()
            assert not same or abs(np.sin(chi[n // 2, k])) > 1e-6
    assert symmetric > 1


def test_slopes_are_differences() -> None:
    """The slope of I = U V behind the last crossing, where U vanishes, against orbits beside."""
    found, step = orbits(2), 1e-7
    assert found.chain.residual.max() < 1e-13
    U = [track(level(), found.b + side * step, 2).U for side in (-1, 1)]
    slope = (U[1] - U[0]) / (2 * step) * found.V
    np.testing.assert_allclose(slope, found.I_slope, rtol=1e-5, atol=0)


def test_corrections_may_be_rounding() -> None:
    """Where surfaces are split by 2e-10, roundings displace orbits along them by 1e-9 and more."""
    body = Body(A=(2, "1.66", "1.92"), r=(79, 61, 0), mu="0.0006")
    little = Level.of(body, exact("1.5"))
    found = doubly_asymptotic(little, skeleton(little, 1, 97)[1][0])
    assert found.chain.residual.max() < 1e-12


def test_a_track_that_is_far_off_is_refused() -> None:
    one = rough(2)[2]
    with pytest.raises(NoOrbit, match="elsewhere"):
        doubly_asymptotic(level(), one._replace(b=one.b + 0.01))


def test_a_track_that_doubles_do_not_place_is_refused_with_that_reason() -> None:
    """Some orbits with two symbols change sides at downward crossings, those with one do not."""
    near, (_, (one, _), (two, _)) = copy.copy(level()), skeleton(level(), 2, 12)
    near.downward = math.ldexp(near.unit, -43)
    with pytest.raises(NoOrbit, match=r"at the Hess case or near it: .* at downward crossings"):
        doubly_asymptotic(near, two._replace(b=two.b + 0.01))
    with pytest.raises(NoOrbit, match="elsewhere"):
        doubly_asymptotic(near, one._replace(b=one.b + 0.01))
