"""Starts are where they say, and an error larger than roundings is noticed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.stress.layout import FAILED, PASSED
from rigidpend.experiments.stress.trials import starts, truth
from rigidpend.experiments.stress.trials.claims import tried
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, canonical_from_aligned
from rigidpend.orbits import integrate
from tests.orbits.integrate.problems import FIG4, GENERIC

WAY = truth.Way(integrate.default_engine())


@pytest.mark.parametrize("place", starts.PLACES, ids=lambda x: x.name)
def test_places_are_where_they_say(place: starts.Place) -> None:
    made = Aligned(*starts.state(place, FIG4, 0.7))
    M, gamma = body_from_aligned(made, FIG4.alpha0, 1.0)
    back = canonical_from_aligned(made, FIG4.alpha0, FIG4.beta0)
    assert M @ gamma == pytest.approx(place.J3, abs=1e-14)
    assert float(back.J1) == pytest.approx(place.J1, rel=1e-12)
    assert float(back.J2mJ1) == pytest.approx(place.J2mJ1, rel=1e-12)
    large, small = (made.Qp, made.Qm) if place.separatrix in (2, 4) else (made.Qm, made.Qp)
    assert (small == 0) == (place.aside == 0)
    assert np.sign(large) == {1: -1, 2: 1, 3: 1, 4: -1}[place.separatrix]


def test_a_start_passes_and_a_spoilt_tolerance_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    place = starts.Place("x", 3, 1e-3, 1.4, 1e-4, 0.2)

    def verdict() -> str:
        trial = starts.trial(GENERIC, place, WAY, columns=1, n_crossings=2)
        made: Any = tried(trial)
        [found] = made["claims"].values()
        return str(found["verdict"].values)

    assert verdict() == PASSED
    monkeypatch.setattr(truth, "DEFAULT_TOLERANCE", {WAY.engine: 1e-6})
    assert verdict() == FAILED
