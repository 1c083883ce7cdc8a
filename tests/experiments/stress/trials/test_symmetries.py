"""The symmetries hold, and a broken one is noticed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.stress.trials import symmetries
from rigidpend.experiments.stress.trials.claims import FAILED, PASSED, tried
from rigidpend.experiments.stress.trials.truth import Scene, Way
from rigidpend.mechanics.equations import aligned
from rigidpend.orbits import integrate
from tests.orbits.integrate.problems import GENERIC

SCENE = Scene(GENERIC, 1.3)
C = SCENE.c
X = np.array([0.4, -0.2, 0.9, 0.3, -0.5, 0.8])


def test_the_field_has_the_symmetries() -> None:
    rates = np.array(aligned(X, C))
    assert np.array_equal(aligned(symmetries.MIRROR * X, C), symmetries.MIRROR * rates)
    assert np.array_equal(aligned(symmetries.REVERSAL * X, C), -symmetries.REVERSAL * rates)


def test_other_units_are_the_same_field() -> None:
    states, coefficients = symmetries._in_units(X[:, None], C, 1.37, 0.73)
    units = np.array([1.37] * 3 + [0.73] * 3)
    found = np.array(aligned(states[:, 0], coefficients))
    assert np.allclose(found, 1.37 * units * np.array(aligned(X, C)), rtol=1e-14)


def test_all_hold_and_a_wrong_mirror_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    def verdicts() -> dict[str, str]:
        made: Any = tried(symmetries.trial(SCENE, 2, Way(integrate.default_engine())))
        return {name: str(claim["verdict"].values) for name, claim in made["claims"].items()}

    right = verdicts()
    assert set(right.values()) == {"passed"}
    assert len(right) == 6
    monkeypatch.setattr(symmetries, "MIRRORED", np.arange(5))
    monkeypatch.setattr(symmetries, "REVERSAL", -symmetries.REVERSAL)
    wrong = {name for name, verdict in verdicts().items() if verdict == "FAILED"}
    assert wrong == {"reflection", "time reversal"}


def test_bounds_are_those_of_theory() -> None:
    """Bit for bit, ten standard deviations of a difference, and what ten passages make of 2e-11."""
    most = {
        "reflection": 0.0,
        "time reversal": 0.0,
        "there and back": 14.15,
        "units of 2 and 4": 14.15,
        "units of 1.37 and 0.73": 14.15,
        "theta2_0 + 2 pi": 1e-5,
    }
    assert {claim.name for claim in symmetries.CLAIMS} == set(most)
    for claim in symmetries.CLAIMS:
        assert claim.limit is None
        assert claim.verdict(0.99 * most[claim.name]) == PASSED
        assert claim.verdict(1.01 * most[claim.name] + 1e-9) == FAILED
    assert 1e-6 < 2e-11 * 3.5**9 * 4 / 3 * 1.42 < symmetries.TURNED < 1e-4
