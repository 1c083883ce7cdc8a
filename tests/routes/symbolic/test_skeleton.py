"""The skeleton misses no orbit of scans that know nothing of arcs and phases."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.numbers.generic import Array
from rigidpend.routes.symbolic import asymptotic as module
from rigidpend.routes.symbolic.asymptotic import skeleton, track
from tests.routes.symbolic.fig4 import HALF_TURNS, level, rough


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
def test_a_blind_scan_finds_the_same_orbits() -> None:
    found = skeleton(level(), 2, 11)
    for n, count in enumerate((2, 6, 34)):
        blind = scanned(0.0, 2 * np.pi, 60_000, n, 11)
        b = np.sort(np.mod(found[n].b, 2 * np.pi))
        assert len(b) == count
        assert blind.size == count
        np.testing.assert_allclose(np.sort(blind), b, rtol=0, atol=2 * np.pi / 60_000)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "count"), [(3, 18), (4, 104)])
def test_a_blind_scan_of_windows_finds_the_same_orbits(n: int, count: int) -> None:
    """Windows in the densest parts, where arcs turn back and zeros end in pairs."""
    b = np.sort(np.mod(rough(4)[n].b, 2 * np.pi))
    assert len(b) == count
    gaps = np.diff(b)
    for k in np.argsort(gaps)[[0, len(gaps) // 8]]:
        low, high = max(0.0, b[k] - 13 * gaps[k]), min(b[k] + 40 * gaps[k], 2 * np.pi)
        inside = b[(b > low) & (b < high)]
        blind = scanned(low, high, 10_000, n, HALF_TURNS)
        assert inside.size >= 2
        np.testing.assert_allclose(blind, inside, rtol=0, atol=(high - low) / 5_000)


@pytest.mark.slow
@pytest.mark.parametrize(("per_cell", "half_turns"), [(3, 11), (25, 10)])
def test_a_coarser_and_a_finer_grid_find_as_many(
    per_cell: int, half_turns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With three samples a half rotation many pairs lie between samples: least |U| finds them."""
    expected = [len(one.b) for one in skeleton(level(), 3, half_turns)]
    monkeypatch.setattr(module, "PER_CELL", per_cell)
    assert [len(one.b) for one in skeleton(level(), 3, half_turns)] == expected


def test_longer_passages_keep_what_shorter_ones_have() -> None:
    few, many = skeleton(level(), 2, 9), rough(2)
    for less, more in zip(few, many, strict=True):
        gap = np.abs(np.mod(less.b[:, None] - more.b + np.pi, 2 * np.pi) - np.pi)
        assert (gap.min(axis=1, initial=np.inf) < 1e-9).all()
        inside = (more.track.half_turns <= 9).all(axis=0)
        assert inside.sum() == len(less.b)
