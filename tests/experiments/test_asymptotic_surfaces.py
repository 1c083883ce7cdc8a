"""The experiment `asymptotic_surfaces`: the surfaces of Fig. 3, and results told apart."""

import math
from typing import Any

import mpmath
import numpy as np
import pytest

from rigidpend.experiments.asymptotic_surfaces import CURVES
from rigidpend.mechanics.pendulum import Delta_1
from rigidpend.numbers.exact import exact
from rigidpend.surfaces.curves import S1_minus, surface_problem
from tests.experiments.trees import asked, computed, differences, reference, unlike_stored


@pytest.mark.slow
def test_each_body_is_a_part_of_the_run_and_all_are_as_they_are_stored() -> None:
    parts: list[str] = []
    fresh = computed(asked("fig3"), parts)
    assert parts == list("abcdefg")
    assert unlike_stored("fig3", fresh, {}) == set()


def test_the_swing_of_a_thin_body_keeps_its_digits() -> None:
    """pi - alpha0 is 1.4e-4, of which an angle in doubles has twelve digits.

    Without J1 (eq1) has the solution theta1 - centre of the rate -u and a drive of the rate
    kappa J2, of amplitude 2 mu sin(centre/2)/J2.
    """
    grid = "problem.theta2_0={start: 0, step: 1, count: 1}"
    asks = "problem.bodies={x: [1, 1e-4, 0.99995]}", "problem.beta0=2", grid
    found = computed(asked("fig3", *asks))["bodies"]["x"]["Delta_1"]
    with mpmath.workdps(40):
        A1, A2, A3 = 1, mpmath.mpf("1e-4"), mpmath.mpf("0.99995")
        alpha0 = 2 * mpmath.atan(mpmath.sqrt(A1 * (A3 - A2) / (A2 * (A1 - A3))))
        kappa = A1 * A2 / (A3 * (A1 - A2))
        J2_2 = 4 / (A3 * kappa)
        drive = mpmath.mpf("0.02") * abs(mpmath.sin(alpha0 / 2 + 1))
        expected = float(drive / J2_2 / mpmath.hypot(mpmath.sin(alpha0), kappa))
    assert found == pytest.approx(expected, rel=1e-15, abs=0)


def test_samples_at_other_times_are_no_agreement() -> None:
    """The points of both have no time in common, so that nothing else is compared."""
    data, later = (reference("fig3")["data"] for _ in range(2))
    later["bodies"]["a"]["S1_minus"]["sample"] += 10000
    [found] = differences("asymptotic_surfaces", data, later)
    assert "same times" in found
    # Nor are there any where the curves do not end with the points.
    later["bodies"]["a"]["S1_minus"]["offsets"][-1] -= 1
    times, ends = differences("asymptotic_surfaces", data, later)
    assert ("offsets" in ends, "same times" in times) == (True, True)


def test_a_sample_that_rounding_leaves_out_is_no_difference() -> None:
    data, fewer = (reference("fig3")["data"] for _ in range(2))
    surface = fewer["bodies"]["a"]["S1_minus"]
    for name in ("theta1", "J1_over_J2", "sample"):
        surface[name] = np.delete(surface[name], 1)
    surface["offsets"][1:] -= 1
    assert differences("asymptotic_surfaces", data, fewer) == []


@pytest.mark.parametrize(("part", "told"), [(0.9, 0), (1.1, 1)])
def test_points_are_compared_where_both_have_one_and_phases_also_across_the_cut(
    part: float, told: int
) -> None:
    """The fresh one lacks the second of four; at J1 = J2/2 an error has not grown."""
    phase: Any
    theta1: Any
    phase, theta1 = (CURVES["S1_minus"][name].within for name in ("theta2_0", "theta1"))
    ends = ({"theta2_0": np.array([x])} for x in (0.0, 2 * np.pi - part * 1e-11))
    assert len(phase("theta2_0", *ends)) == told
    stored = {"sample": np.arange(4), "theta1": np.arange(4.0), "offsets": np.array([0, 4])}
    fresh = {"sample": np.array([0, 2, 3]), "theta1": np.array([0.0, 2.0, 3.0 + part * 1e-12])}
    both = stored | {"J1_over_J2": np.full(4, 0.5)}, fresh | {"offsets": np.array([0, 3])}
    assert len(theta1("theta1", *both)) == told


@pytest.mark.parametrize("J1", [[1.0, 1.0, 0.9, 0.3], [1e-9] + 1500 * [0.1, 0.9]])
def test_ratios_that_round_to_1_and_errors_beyond_doubles_are_compared(J1: list[float]) -> None:
    count = len(J1)
    within: Any = CURVES["S2_plus"]["J1_over_J2"].within
    stored = {
        "offsets": np.array([0, count]),
        "sample": 10 * np.arange(count),
        "theta1": np.zeros(count),
    }
    stored["J1_over_J2"] = np.array(J1)
    assert within("J1_over_J2", stored, stored) == []
    fresh = stored | {"J1_over_J2": np.array(J1) + (np.arange(count) < 1) * 1e-11}
    assert len(within("J1_over_J2", stored, fresh)) == 1


def test_errors_grow_on_each_way_from_halfway_as_a_cosine_and_with_late_rounding() -> None:
    """Between J1 = 0 and J1 = J2 the ratio is a logistic function of time."""
    x = np.append(np.arange(-100, 10, 0.1), np.arange(10, -10, -0.1))
    stored = {"J1_over_J2": 1 / (1 + np.exp(-x)), "theta1": 0 * x}
    stored |= {"offsets": np.array([0, len(x)]), "sample": 10 * np.arange(len(x))}
    within: Any = CURVES["S1_minus"]["J1_over_J2"].within
    late = (1 + stored["sample"] / 20_000) ** 1.5
    # The way out to x = 10, the way back, and that to -10; the ratio errs as the cosine less.
    for at, allowed in ((-1, math.cosh(10 / 2) ** 2), (1000, 1.0), (1050, 1.0)):
        for part, told in ((0.98, 0), (1.02, 1)):
            fresh = stored | {"J1_over_J2": stored["J1_over_J2"].copy()}
            fresh["J1_over_J2"][at] += part * allowed * late[at] * 1e-12
            assert len(within("J1_over_J2", stored, fresh)) == told


def test_errors_grow_with_each_passage_and_no_more_than_in_theory() -> None:
    """In a window of 100 swings of a heavy body orbits come back to J1 = J2/2 many times."""
    A = exact(1), exact("0.324"), exact("0.87")
    problem = surface_problem(A, None, exact("0.2038"), exact(2), exact("1e-60"))
    swing = Delta_1(problem.body.angles(), float(problem.h0), 1, math)
    phases = 2 * np.pi * (np.arange(8) + 0.37) / 8
    data, other = (
        S1_minus(problem, phases, 100 * swing, "taylor", tolerance)._asdict()
        for tolerance in (None, 3e-14)
    )
    orbits = (np.repeat(np.arange(8), np.diff(x["offsets"])) for x in (data, other))
    both = (x["sample"] + 2**32 * k for x, k in zip((data, other), orbits, strict=True))
    _, here, there = np.intersect1d(*both, return_indices=True)
    for name in ("theta1", "J1_over_J2"):
        within: Any = CURVES["S1_minus"][name].within
        assert within(name, data, other) == []
        off = other[name][there] - data[name][here]
        assert np.abs(off).max() > 1e-11
        wrong = {**other, name: other[name].copy()}
        wrong[name][there] = data[name][here] + 1e3 * off
        assert len(within(name, data, wrong)) == 1
