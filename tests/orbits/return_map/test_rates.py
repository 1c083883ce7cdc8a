"""Rates of a map as series in I, shortened to the terms that count."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.orbits.return_map.rates import _reciprocal, _significant, radians


@pytest.mark.parametrize(("last", "terms"), [(1.001, 4), (0.999, 2)])
def test_terms_below_the_threshold_are_left_out(last: float, terms: int) -> None:
    """They are weighed at the end of the range, against the largest of all."""
    series = np.array([[0.5, 0.0, 0.0, 0.0], [8.0, 1.0, 0.0, last * 2.0**-7 / 4**3]])
    kept = _significant(series, reach=4.0, threshold=2.0**-10)
    np.testing.assert_array_equal(kept, series[:, :terms])


def test_a_series_times_its_reciprocal_is_one() -> None:
    series = np.array([[2.0, -0.3, 0.7, 0.1], [0.5, 3.0, -1.0, 2.0]])
    found = [np.convolve(*pair)[:4] for pair in zip(series, _reciprocal(series), strict=True)]
    np.testing.assert_allclose(found, np.tile([1, 0, 0, 0], (2, 1)), atol=1e-13)


def test_turns_are_told_in_two_doubles() -> None:
    high, low = radians(7.0)
    assert (high, abs(low) < 2.0**-48) == (float(14 * np.pi), True)
    assert low != 0
