"""The symmetries hold, and a broken one is noticed."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.experiments.stress import symmetries
from rigidpend.mechanics.equations import aligned
from tests.experiments.stress.verdicts import failed, scene, verdicts
from tests.orbits.integrate.problems import GENERIC

SCENE = scene(GENERIC, 1.3)
C = SCENE.c
X = np.array([0.4, -0.2, 0.9, 0.3, -0.5, 0.8])


def test_the_field_has_the_symmetries_and_is_the_same_in_other_units() -> None:
    rates = np.array(aligned(X, C))
    assert np.array_equal(aligned(symmetries.MIRROR * X, C), symmetries.MIRROR * rates)
    assert np.array_equal(aligned(symmetries.REVERSAL * X, C), -symmetries.REVERSAL * rates)
    states, coefficients = symmetries.in_units(X[:, None], C, 1.37, 0.73)
    units = np.array([1.37] * 3 + [0.73] * 3)
    found = np.array(aligned(states[:, 0], coefficients))
    assert np.allclose(found, 1.37 * units * rates, rtol=1e-14)


def test_all_hold_and_a_wrong_mirror_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = symmetries.trial(SCENE, 2)
    right = verdicts(trial)
    assert (set(right.values()), len(right)) == ({"passed"}, 6)
    monkeypatch.setattr(symmetries, "MIRRORED", np.arange(5))
    monkeypatch.setattr(symmetries, "REVERSAL", -symmetries.REVERSAL)
    assert failed(trial) == {"reflection", "time reversal"}
