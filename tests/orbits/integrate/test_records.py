"""The records of the engines: which separatrix a crossing lies beside, and how orbits end."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigidpend.mechanics.equations import aligned, aligned_coefficients
from rigidpend.mechanics.separatrices import separatrix_beside
from rigidpend.orbits.integrate.records import (
    Outcome,
    joined,
    no_crossings,
    silent_outcome,
)
from tests.orbits.integrate.problems import FREE, on_separatrix


@pytest.mark.parametrize("separatrix", [1, 2, 3, 4])
@pytest.mark.parametrize("nudge", [0.0, 1e-3, -1e-3, 1e-200, -1e-200])
def test_separatrix_beside_knows_the_unperturbed_ones_and_their_neighbours(
    separatrix: int, nudge: float
) -> None:
    state = on_separatrix(separatrix, FREE, 0.5, 0.3)
    assert state[2] == pytest.approx(0, abs=1e-15), "halfway up M3 = 0"
    rising = aligned(state, aligned_coefficients(FREE.angles(), math))[2] > 0
    Qp, Qm = np.where(state[:2] == 0, nudge, state[:2])
    assert separatrix_beside(rising, Qp, Qm) == separatrix


def test_silent_outcome_tells_an_invariant_plane_from_a_slow_orbit() -> None:
    assert silent_outcome(0.0, 0.3) == silent_outcome(-0.2, 0) == Outcome.ASYMPTOTIC
    assert silent_outcome(0.0, 0.0) == Outcome.ASYMPTOTIC
    assert silent_outcome(1e-300, 0.3) == silent_outcome(-0.2, -1e-300) == Outcome.NO_CROSSING


def test_no_crossings_says_that_nothing_is_known() -> None:
    empty = no_crossings(3, 2)
    assert empty.time.shape == empty.separatrix.shape == (3, 2)
    assert np.isnan(empty.time).all()
    assert not empty.separatrix.any()
    assert empty.outcome.tolist() == [Outcome.FAILED] * 2
    assert empty.separatrix.dtype == empty.outcome.dtype == np.uint8


def test_joined_keeps_the_order_of_the_orbits() -> None:
    parts = []
    for width, first in ((2, 0.0), (1, 2.0), (3, 3.0)):
        part = no_crossings(2, width)
        part.time[:] = first + np.arange(width)
        part.separatrix[:] = 1 + first
        part.outcome[:] = first
        parts.append(part)
    whole = joined(parts)
    assert whole.time.tolist() == [[0, 1, 2, 3, 4, 5]] * 2
    assert whole.separatrix.tolist() == [[1, 1, 3, 4, 4, 4]] * 2
    assert whole.outcome.tolist() == [0, 0, 2, 3, 3, 3]
    assert whole.separatrix.dtype == whole.outcome.dtype == np.uint8
