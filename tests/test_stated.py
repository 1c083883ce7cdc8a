"""Errors that results state are errors: the true one is less, and not by far for all cases."""

from __future__ import annotations

import pytest

from scripts import stated

CASES = {
    "splitting": 1,
    "precession": 1,
    "exponents": 1,
    "closed_orbits`: `exponent_error": 3,
    "periodic_orbit": 4,
    "herpolhodes`: `crossing_error": 1,
}
"""Some that take some seconds; `scripts.stated` tries many more."""


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_no_true_error_is_more_than_is_stated(name: str) -> None:
    [one] = [each for each in stated.STATED if each.what.startswith(f"`{name}`")]
    assert 0.001 < stated.measured(one, CASES[name], 4)[-1] <= 1


def test_the_page_has_every_stated_error() -> None:
    block = stated.PAGE.read_text().partition("<!-- stated -->")[2].partition("<!-- /stated -->")[0]
    rows = [line for line in block.splitlines() if line.startswith("| `")]
    assert [row.split(" | ")[0].removeprefix("| ") for row in rows] == [
        each.what for each in stated.STATED
    ]
    assert all(float(row.split(" | ")[-1].removesuffix(" |")) <= 1 for row in rows)
