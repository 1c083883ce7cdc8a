"""Estimates of the time that experiments take, beside times that were measured."""

import pytest

from rigidpend import experiments
from rigidpend.experiments.splitting import compute as splitting
from tests.experiments.trees import asked

BODIES = {
    "fig4": ("[2, 1, 1.5]", "[1, 1, 0]", "0.001", "1.3342"),
    "light": ("[2, 1, 1.5]", "[1, 1, 0]", "0.0001", "1.3342"),
    "heavy": ("[2, 1, 1.5]", "[1, 1, 0]", "0.01", "1.3342"),
    "heavier": ("[2, 1, 1.5]", "[1, 1, 0]", "0.05", "1.3342"),
    "fig5": ("[2, 1.5, 1.8]", "[0, 1, 0]", "0.01", "10/9"),
    "generic": ("[2, 1.2, 1.7]", "[1, 3, 0]", "0.004", "1"),
    "slow": ("[2, 0.2, 1.8]", "[sqrt(0.2), sqrt(1.6), 0]", "0.001", "1"),
    "b": ("[2, 1.04, 1.7]", "[sqrt(0.3), sqrt(0.66), 0]", "0.003", "1"),
    "c": ("[2, 1, 1.2]", "[sqrt(0.8), sqrt(0.2), 0]", "0.001", "1"),
    "e": ("[2, 1.3, 1.72]", "[sqrt(0.28), sqrt(0.42), 0]", "0.01", "1"),
    "long": ("[2, 0.9, 1.4]", "[2, 1, 0]", "0.02", "0.8"),
}
"""A, r, mu and the energy."""
ASYMPTOTIC = {
    ("fig4", 2, 12): 0.46,
    ("fig4", 3, 12): 1.63,
    ("fig4", 4, 10): 1.0,
    ("fig4", 6, 10): 5.25,
    ("light", 2, 12): 0.3,
    ("light", 3, 13): 0.71,
    ("heavy", 2, 10): 0.71,
    ("heavy", 3, 8): 0.47,
    ("heavier", 2, 10): 1.65,
    ("heavier", 3, 8): 2.02,
    ("fig5", 2, 30): 3.03,
    ("fig5", 3, 30): 9.5,
    ("generic", 3, 14): 3.25,
    ("slow", 3, 5): 1.27,
    ("slow", 4, 4): 1.21,
    ("b", 2, 12): 1.55,
    ("c", 2, 14): 1.39,
    ("e", 2, 18): 2.85,
    ("long", 2, 10): 8.78,
    ("long", 3, 6): 2.97,
}
"""Seconds of a core for doubly asymptotic orbits, by the symbols and half rotations at most."""
CLOSED = {
    ("fig4", 11, 8, 0): 1.13,
    ("fig4", 11, 8, 4): 1.62,
    ("fig4", 11, 8, 6): 2.25,
    ("heavy", 9, 8, 4): 1.77,
    ("fig5", 30, 8, 4): 2.23,
    ("e", 18, 8, 4): 1.84,
    ("slow", 5, 8, 4): 1.39,
}
"""The same for closed orbits, by half rotations and symbols that are found and verified."""
INTERVALS = {
    ("fig4", 2, 5): 15.1,
    ("heavy", 2, 5): 14.2,
    ("heavier", 2, 5): 20.1,
    # Of eight of its 32 intervals.
    ("fig5", 2, 5): 54.0,
    ("fig4", 2, 6): 19.0,
    ("fig4", 3, 6): 53.0,
    ("fig4", 3, 8): 138.0,
}
"""The same for intervals of starts, by symbols and halvings; two cores take half as long."""
SHIFTS = {
    ("fig4", 1): 2.0,
    ("fig4", 2): 6.87,
    ("fig4", 3): 19.5,
    ("heavy", 1): 2.88,
    ("generic", 1): 3.71,
    ("slow", 1): 2.33,
    ("e", 1): 5.04,
}
"""The same for full shifts, by lengths."""
ZOOMS = {
    ("fig4", 12, 62, 15): 2.77,
    ("heavy", 12, 62, 15): 3.44,
    ("heavy", 3, 6, 4): 0.57,
    ("generic", 12, 62, 15): 8.74,
    ("generic", 3, 6, 4): 0.77,
    ("slow", 12, 62, 15): 1.92,
    ("slow", 3, 6, 4): 0.37,
    ("e", 12, 62, 15): 14.38,
    ("e", 3, 6, 4): 0.86,
}
"""The same for zooms, by levels, columns and symbols."""
EXPONENTS = {"fig4": 3.48, "heavy": 9.38, "generic": 4.16}
"""The same for the shipped plane of exponents."""
SPLITTING = {"all": 5.7, "generic": 0.36, "fig5": 0.75}
"""The same for the splitting of the shipped config's bodies, or of one with its weights."""


def told(name: str, body: str, energy: str, **settings: int | str) -> float:
    """The estimate for a shipped config with another body."""
    given = dict(zip(("A", "r", "mu", energy), BODIES[body], strict=True)) | settings
    config = asked(name, *(f"problem.{key}={value}" for key, value in given.items()))
    found = experiments.cost(config.experiment, config)
    assert found is not None
    return found


@pytest.mark.parametrize("case", ASYMPTOTIC, ids=str)
def test_doubly_asymptotic_orbits_take_a_third_to_thrice_the_estimate(
    case: tuple[str, int, int],
) -> None:
    body, symbols, half_turns = case
    estimate = told("asymptotic_orbits", body, "h", symbols=symbols, half_turns=half_turns)
    assert 1 / 3 < estimate / ASYMPTOTIC[case] < 3


@pytest.mark.parametrize("case", CLOSED, ids=str)
def test_closed_orbits_take_a_third_to_thrice_the_estimate(
    case: tuple[str, int, int, int],
) -> None:
    body, half_turns, longest, verified = case
    settings = {"half_turns": half_turns, "longest": longest, "verified": verified}
    assert 1 / 3 < told("closed_orbits", body, "h", **settings) / CLOSED[case] < 3


@pytest.mark.parametrize("case", INTERVALS, ids=str)
def test_intervals_take_a_third_to_thrice_the_estimate(case: tuple[str, int, int]) -> None:
    body, n_symbols, halvings = case
    estimate = told("fig4_intervals", body, "h0", n_symbols=n_symbols, halvings=halvings)
    assert 1 / 3 < 2 * estimate / INTERVALS[case] < 3


@pytest.mark.parametrize("case", SHIFTS, ids=str)
def test_full_shifts_take_a_third_to_thrice_the_estimate(case: tuple[str, int]) -> None:
    body, lengths = case
    estimate = told("full_shift", body, "h", half_turns="null", lengths=lengths)
    assert 1 / 3 < estimate / SHIFTS[case] < 3


@pytest.mark.parametrize("case", ZOOMS, ids=str)
def test_zooms_take_a_third_to_thrice_the_estimate(case: tuple[str, int, int, int]) -> None:
    body, levels, count, n_symbols = case
    settings = {"levels": levels, "count": count, "n_symbols": n_symbols}
    assert 1 / 3 < told("fig4_zoom", body, "h0", **settings) / ZOOMS[case] < 3


@pytest.mark.parametrize("body", EXPONENTS)
def test_exponents_take_a_third_to_thrice_the_estimate(body: str) -> None:
    assert 1 / 3 < told("exponents", body, "h0") / EXPONENTS[body] < 3


@pytest.mark.parametrize("body", SPLITTING)
def test_splittings_take_a_third_to_thrice_the_estimate(body: str) -> None:
    A, r, *_ = BODIES.get(body, ("", ""))
    one = (f"problem.bodies={{q: {{A: {A}, r: {r}}}}}", "problem.drawn=q") if A else ()
    assert 1 / 3 < splitting.cost(asked("splitting", *one)) / SPLITTING[body] < 3
