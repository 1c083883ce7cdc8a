"""Doubly asymptotic orbits to rounding: symmetry, theta3, passages by integration."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.symbolic.asymptotic import doubly_asymptotic, leaving, track
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.surfaces.heteroclinic import increments
from tests.routes.symbolic.fig4 import BODY, H, level, orbits, rough


def test_without_symbols_they_cross_at_gamma3_0() -> None:
    found = orbits(0)
    np.testing.assert_allclose(np.sin(found.chain.chi[0]), 0, atol=1e-14)
    assert found.flight.tolist() == [0.0, 0.0]
    assert sorted(str(found.address(k)) for k in (0, 1)) == ["a", "b"]


def test_theta3_grows_as_integration_has_it() -> None:
    gained = increments(BODY, H, resolve()).gained[:, 1]
    np.testing.assert_allclose(np.sort(orbits(0).theta3), np.sort(gained), rtol=0, atol=1e-13)


def test_the_reversor_takes_heteroclinic_orbits_to_such_and_symmetric_codes_to_themselves() -> None:
    n = 2
    found = orbits(n)
    turns = np.diff(found.cells, axis=0)
    symmetric = 0
    for k in range(len(found.b)):
        away = np.abs(np.exp(1j * found.chain.chi) - np.exp(-1j * found.chain.chi[::-1, k : k + 1]))
        image = int(np.argmin(away.max(axis=0)))
        assert away[:, image].max() < 1e-9
        np.testing.assert_allclose(
            found.chain.d[:, image], found.chain.d[::-1, k], rtol=0, atol=1e-12
        )
        np.testing.assert_array_equal(found.symbols[:, image], 1 - found.symbols[::-1, k])
        np.testing.assert_array_equal(turns[:, image], turns[::-1, k])
        np.testing.assert_allclose(found.theta3[image], found.theta3[k], rtol=0, atol=1e-12)
        if image == k:
            symmetric += 1
            assert abs(np.sin(found.chain.chi[n // 2, k])) < 1e-11
        else:
            # No other orbit with a symmetric code and the same half rotations.
            same = (found.symbols[:, k] == found.symbols[:, image]).all()
            assert not same or abs(np.sin(found.chain.chi[n // 2, k])) > 1e-6
    assert symmetric > 1


def test_the_map_follows_them_from_crossing_to_crossing() -> None:
    """The chain joins inverse charts, where here passages lead forward."""
    chain = orbits(3).chain
    for k in range(3):
        passed = level().map_level.passage(SectionPoint(k % 2 == 0, chain.d[k], chain.chi[k]))
        np.testing.assert_allclose(passed.turned, np.diff(chain.chi, axis=0)[k], atol=1e-10)
        np.testing.assert_allclose(passed.point.d, chain.d[k + 1], rtol=0, atol=1e-12)
        np.testing.assert_allclose(passed.time, chain.time[k], rtol=0, atol=1e-9)
    assert chain.residual.max() < 1e-13


def test_slopes_are_differences() -> None:
    """The slope of I behind the last crossing, against the I of orbits beside."""
    found, step = orbits(2), 1e-7
    seen = [track(level(), found.b + side * step, 2) for side in (-1, 1)]
    I = [leaving(level(), True, each.d[-1], each.chi[-1]).I for each in seen]
    slope = (I[1] - I[0]) / (2 * step)
    np.testing.assert_allclose(slope, found.I_slope, rtol=1e-5, atol=0)


def test_a_track_that_is_far_off_is_refused() -> None:
    one = rough(2)[2]
    with pytest.raises(NoOrbit, match="elsewhere"):
        doubly_asymptotic(level(), one._replace(b=one.b + 0.01))
