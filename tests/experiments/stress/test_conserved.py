"""Symmetries hold; drifts are random walks where nothing but rounding is at work, only there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.stress import conserved, passages
from rigidpend.experiments.stress.passages import step
from rigidpend.experiments.stress.scenes import Scene
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import aligned
from rigidpend.routes.problem import rotation_period
from tests.experiments.stress.verdicts import failed, verdicts
from tests.orbits.integrate.problems import FIG4, GENERIC

SCENE = Scene(GENERIC, 1.3, 1, 4)
C = SCENE.c
X = np.array([0.4, -0.2, 0.9, 0.3, -0.5, 0.8])


def test_the_field_has_the_symmetries_and_is_the_same_in_other_units() -> None:
    rates = np.array(aligned(X, C))
    assert np.array_equal(aligned(conserved.MIRROR * X, C), conserved.MIRROR * rates)
    assert np.array_equal(aligned(conserved.REVERSAL * X, C), -conserved.REVERSAL * rates)
    states, coefficients = conserved.in_units(X[:, None], C, 1.37, 0.73)
    units = np.array([1.37] * 3 + [0.73] * 3)
    found = np.array(aligned(states[:, 0], coefficients))
    assert np.allclose(found, 1.37 * units * rates, rtol=1e-14)


def test_all_hold_and_wrong_mirrors_and_large_errors_do_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    trial = conserved.symmetries(SCENE)
    right = verdicts(trial)
    assert (set(right.values()), len(right)) == ({"passed"}, 6)
    monkeypatch.setattr(conserved, "MIRRORED", np.arange(5))
    monkeypatch.setattr(conserved, "REVERSAL", -conserved.REVERSAL)
    monkeypatch.setattr(passages, "NOISE", passages.NOISE / 100)
    assert failed(trial) == set(right) - {"theta2_0 + 2 pi"}


def drift(engine: str, tolerance: float, rotations: int = 300, orbits: int = 8) -> Any:
    return conserved.engine_trial(SCENE, engine, tolerance, rotations, orbits).tried()


def test_integrals_are_energy_length_and_projection() -> None:
    s = float(scale(GENERIC.floats()[0]))
    M, gamma = body_from_aligned(Aligned(*conserved.passing(SCENE, 3)), GENERIC.alpha0, s)
    h, half_square, along = conserved.integrals(SCENE, M, gamma)
    assert np.allclose(half_square, 0.5, rtol=1e-15)
    assert np.allclose(along, 0.2, rtol=1e-14)
    # On the separatrix without weight the energy is h0.
    assert np.allclose(h, 1, atol=float(GENERIC.mu) / (GENERIC.kappa * 1.3**2 / 2))


def test_slope_is_the_power_of_the_late_times() -> None:
    rotations = np.geomspace(1, 1e4, 61)
    row = 1e-16 * rotations**0.7 + np.where(rotations < 90, 1e-10, 0)
    assert conserved.slope(rotations, row) == pytest.approx(0.7)


def test_the_finest_tolerance_walks_at_random_and_a_coarse_one_does_not() -> None:
    assert failed(drift("taylor", 2.0**-52)) == set()
    coarse = list(verdicts(drift("taylor", 1e-9)).values())
    assert coarse.count("FAILED") >= 2, "no declared bias is as large"


def test_scipy_keeps_its_tolerance() -> None:
    made = drift("scipy", 1e-9, 10, 2)
    assert (len(verdicts(made)), failed(made)) == (3, set())
    drifts = made["curves"]["scipy_1.0e-09"]["drift"]
    assert drifts.max() > 1e-13
    # From the start, not from the first look.
    assert drifts[:, 0].any()


def test_a_drift_is_held_against_the_tolerances_of_all_steps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shares = np.array([[0.9], [1.1], [0.5]])
    monkeypatch.setattr(
        conserved,
        "_engine_drift",
        lambda scene, _, tolerance, marks, __: shares * tolerance * marks[1:] / step(scene.u),
    )
    assert failed(drift("scipy", 1e-9)) == {"scipy at 1.0e-09, gamma"}


def test_the_pendulum_keeps_its_period_and_another_is_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    trial = conserved.pendulum_trial(FIG4, "1.3342", 1, 300)
    assert failed(trial) == set()
    longer: Any = lambda problem: rotation_period(problem) * (1 + 1e-12)  # noqa: E731
    monkeypatch.setattr(conserved, "rotation_period", longer)
    assert failed(trial) == {"pendulum at J1 = 0"}
