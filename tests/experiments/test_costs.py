"""Estimates of the time that experiments take, beside times that were measured."""

from collections.abc import Iterator
from typing import Any
from unittest.mock import Mock

import pytest

from rigidpend import experiments
from rigidpend.routes.symbolic import levels
from tests.experiments.trees import asked

BODIES = {
    "fig4": ("[2, 1, 1.5]", "[1, 1, 0]", "0.001", "1.3342"),
    "heavy": ("[2, 1, 1.5]", "[1, 1, 0]", "0.01", "1.3342"),
    "shallow": ("[2, 1, 1.5]", "[3, 1, 0]", "0.01", "1.3342"),
    "fig5": ("[2, 1.5, 1.8]", "[0, 1, 0]", "0.01", "10/9"),
    "generic": ("[2, 1.2, 1.7]", "[1, 3, 0]", "0.004", "1"),
    "slow": ("[2, 0.2, 1.8]", "[sqrt(0.2), sqrt(1.6), 0]", "0.001", "1"),
    "e": ("[2, 1.3, 1.72]", "[sqrt(0.28), sqrt(0.42), 0]", "0.01", "1"),
    "flat": ("[2, 1.57, 1.82]", "[0.18, 0.98, 0]", "0.0042", "1"),
    "axis": ("[0.5, 0.2, 0.35]", "[1, 0, 0]", "30", "600"),
    "long": ("[2, 0.9, 1.4]", "[2, 1, 0]", "0.02", "0.8"),
    "deep": ("[1.644, 0.946, 1.628]", "[0.907, 0.422, 0]", "0.00622", "1.256"),
}
"""A, r, mu and the energy."""
TIMES: dict[tuple[str, ...], dict[tuple[Any, ...], float]] = {
    # Doubly asymptotic orbits.
    ("asymptotic_orbits", "h", "symbols", "half_turns"): {
        ("fig4", 3, 12): 1.63,
        ("fig4", 6, 10): 5.25,
        ("shallow", 6, 7): 2.4,
        ("fig5", 3, 30): 9.5,
        ("generic", 3, 14): 3.25,
        ("long", 2, 10): 8.78,
    },
    ("closed_orbits", "h", "half_turns", "longest", "verified"): {
        ("fig4", 11, 8, 0): 1.13,
        ("fig4", 11, 8, 6): 2.25,
        ("fig5", 30, 8, 4): 2.23,
    },
    # Of two cores, for which the estimate stands.
    ("fig4_intervals", "h0", "n_symbols", "halvings"): {
        ("axis", 1, 4): 4.1,
        # Of eight of its 32 intervals.
        ("fig5", 2, 5): 27,
        ("fig4", 3, 8): 69,
    },
    ("full_shift", "h", "lengths", "half_turns"): {
        ("fig4", 1, "null"): 2.0,
        ("fig4", 3, "null"): 19.5,
        ("fig5", 1, "null"): 18.7,
        ("flat", 1, "null"): 23.9,
    },
    ("fig4_zoom", "h0", "levels", "count", "n_symbols"): {
        ("fig4", 12, 62, 15): 2.77,
        ("e", 12, 62, 15): 14.38,
    },
    # Down to a step of 31 digits.
    ("fig4_zoom", "h0", "factor", "levels", "count", "n_symbols"): {
        ("heavy", 10**6, 6, 9, 15): 5.9,
    },
    ("fig4_zoom", "h0", "step", "levels", "count", "n_symbols"): {
        ("heavy", "1e-33", 1, 3, 60): 34,
        ("heavy", "1e-48", 1, 9, 30): 18,
    },
    # Many orbits are integrated alone.
    ("fig4_zoom", "h0", "J1_0", "levels", "count", "n_symbols"): {
        ("deep", "4.66e-7", 1, 30, 30): 27,
    },
    # Of a crowded machine, whose cores are 1.7 times slower than a Xeon's; half of it on two cores.
    ("fig4", "h0", "n_symbols", "arrays"): {
        ("fig4", 15, "{a: {start: 0, step: 2*pi/20000, count: 20000}}"): 3.6,
        ("fig4", 60, "{a: {start: 0, step: 2*pi/1000, count: 1000}}"): 6.1,
        ("fig4", 60, "{a: {start: 0, step: 2*pi/4000, count: 4000}}"): 21,
    },
    # The smallest one, there too.
    ("fig4_zoom", "h0", "levels", "count", "n_symbols", "between"): {
        ("fig4", 1, 3, 2, "[4.7, 4.8]"): 1.34,
    },
    # Of 24 energies with 60 actions each, whose orbits are integrated.
    ("route_map", "h0", "theta2_0", "zooms", "columns", "rows"): {
        (
            "fig4",
            "0.2",
            "{}",
            "{axis: log10_J1_0, ends: [-9, -3], count: 60}",
            "{axis: h0, ends: [0.1, 1], count: 24}",
        ): 1.75,
    },
    ("exponents", "h0"): {("fig4",): 3.48, ("heavy",): 9.38, ("generic",): 4.16},
}
"""Seconds that were measured, of a core but for the intervals, by the body and settings.

Keys are the shipped config, the name of its energy, and those of the settings. More were measured:
of slips in the estimates these notice the same."""
PRECESSION = {"all": 1.52, "slow": 0.27, "generic": 0.36, "fig5": 0.44, "flat": 0.46}
SPLITTING = {"all": 5.7, "generic": 0.36, "fig5": 0.75}
"""The same for two more experiments: of the shipped config's bodies, or of one with its weights."""


def by_body() -> Iterator[tuple[str, tuple[str, ...], float]]:
    """Configs, with settings, and the seconds of those above."""
    for (name, *keys), times in TIMES.items():
        for (body, *values), seconds in times.items():
            given = zip(("A", "r", "mu", *keys), (*BODIES[body], *values), strict=True)
            yield name, tuple(f"problem.{key}={value}" for key, value in given), seconds
    for name, several in (("precession", PRECESSION), ("splitting", SPLITTING)):
        for body, seconds in several.items():
            A, r, *_ = BODIES.get(body, ("", ""))
            one = (f"problem.bodies={{q: {{A: {A}, r: {r}}}}}",) if A else ()
            # The splitting draws one of its bodies, the precession one of its weights.
            drawn = ("problem.drawn=q",) if A and name == "splitting" else ()
            yield name, (*one, *drawn), seconds


NEAR = "problem.bodies={near: [0.37, 0.2, 0.3699]}"
CASES = [
    *by_body(),
    # Surfaces of nearly symmetric bodies have a hundred times as many samples.
    ("fig3", (), 0.57),
    ("fig3", (NEAR, "problem.theta2_0={start: 0, step: 0.01, count: 600}"), 5.96),
    ("fig3", (NEAR.replace("0.3699", "0.369999"),), 3.65),
    ("fig3", ("problem.theta2_0={start: 0, step: 0.003, count: 2000}",), 12.15),
    # No precision resolves what pairs of doubles may.
    (
        "splitting",
        (
            "problem.bodies={q: {A: [2, 1, 1.0017], r: [1, 1, 0]}}",
            "problem.drawn=q",
            "problem.mu=[1e-5, 1e-4, 1e-3]",
        ),
        0.9,
    ),
    # A small one, on a crowded machine.
    (
        "route_map",
        (
            "problem.A=[2, 0.2, 1.8]",
            "problem.r=[sqrt(0.2), sqrt(1.6), 0]",
            "problem.h0=1",
            "problem.zooms={}",
            "problem.theta2_0.count=120",
            "problem.rows={axis: mu, ends: [1e-5, 0.01], count: 20}",
        ),
        0.73,
    ),
    # One row of twelve takes most: its body is nearly symmetric.
    (
        "route_map",
        (
            "problem.A=[2.214, 1.528, 2.042]",
            "problem.r=[0.862, 0.507, 0]",
            "problem.mu=0.00615",
            "problem.h0=1.2815",
            "problem.J1_0=4.72e-12",
            "problem.zooms={}",
            "problem.theta2_0.count=60",
            "problem.rows={axis: alpha0, ends: [0.05, 3], count: 12}",
        ),
        1.8,
    ),
]


@pytest.mark.parametrize(("name", "settings", "seconds"), CASES, ids=str)
def test_experiments_take_a_third_to_thrice_the_estimate(
    name: str, settings: tuple[str, ...], seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a map: that takes a second, which a dry run should not."""
    monkeypatch.setattr(levels, "return_map", Mock(side_effect=AssertionError))
    estimate = experiments.cost(asked(name, *settings))
    assert 1 / 3 < estimate / seconds < 3


@pytest.mark.parametrize("name", ["fig4", "splitting", "precession"])
def test_what_was_measured_with_one_engine_is_no_estimate_for_the_other(name: str) -> None:
    """With scipy a splitting that was told to take a second took more than a minute."""
    assert experiments.cost(asked(name, "numerics.engine=taylor")) > 0
    assert experiments.cost(asked(name, "numerics.engine=scipy")) == 0
