"""The experiment `closed_orbits`: counts, averages, verification, results told apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.closed_orbits.draw import tables
from tests.experiments.trees import asked, computed, unlike_stored

SMALL = ["problem.longest=5", "problem.verified=2", "problem.symbols=1000"]


@pytest.fixture(scope="module")
def data() -> Any:
    return computed(asked("closed_orbits", *SMALL))


def test_shorter_words_have_what_is_stored_of_them(data: Any) -> None:
    """Fewer of them are verified, and the random orbit is a shorter one."""
    few = {"words": data["orbits"]["word"], "longest": range(5), "lengths": range(5)}
    kept = {key: np.arange(len(x)) for key, x in (few | {"points": data["places"]["of"]}).items()}
    verified = {f"orbits/{x}" for x in ("closing", "closing_expected")}
    assert unlike_stored("closed_orbits", data, kept) == verified | {
        f"averages/{x}" for x in ("long_orbit", "long_orbit_error")
    }


def test_points_are_those_of_a_full_shift(data: Any) -> None:
    np.testing.assert_array_equal(data["averages"]["points"], 2 ** np.arange(1, 6))
    assert not data["orbits"]["stable"].any()
    # Words of odd length are read twice; upward crossings are every other one.
    lengths = (data["orbits"]["word"] < 2).sum(axis=1)
    np.testing.assert_array_equal(
        np.bincount(data["places"]["of"]), np.where(lengths % 2, lengths, lengths // 2)
    )


def test_orbits_close(data: Any) -> None:
    orbits = data["orbits"]
    verified = np.isfinite(orbits["closing"])
    assert verified.sum() == 4
    assert (orbits["closing"][verified] < orbits["closing_expected"][verified]).all()
    assert orbits["alone"].max() < 1e-11


def test_words_of_up_to_four_symbols_have_a_row_each(data: Any) -> None:
    """Of eight words up to rotation, four are of even length and two orbits each."""
    rows = tables({"attributes": {}, "config": {}, "provenance": {}, "data": data})[0].rows
    words = [row[0] for row in rows]
    assert len(set(words)) == len(words) == 12
    assert {"0", "01", "001", "0001"} <= set(words)


def test_averages_agree_with_the_long_orbit(data: Any) -> None:
    averages = data["averages"]
    off = np.abs(averages["mean"][1:] - averages["long_orbit"])
    assert (off < 4 * averages["long_orbit_error"]).all()
    # They settle exponentially: neighbours further off matter ever less.
    near = np.abs(averages["mean"][:-1] - averages["mean"][-1])
    assert (near[1:] < near[:-1] / 10).all()
