"""Drifts are random walks where nothing but rounding is at work, and only there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import integrate
from rigidpend.coordinates import Aligned, body_from_aligned, scale
from rigidpend.integrate.lie_poisson import splitting
from rigidpend.measure.stress import long_time
from tests.integrate.problems import GENERIC, needs_heyoka

ENGINE = integrate.default_engine()
SETTING = long_time.Setting(GENERIC, 1.3, 4)


def verdicts(tree: Any) -> list[str]:
    return [str(case["verdict"].values) for case in tree["cases"].values()]


def drift(engine: str, tolerance: float, rotations: int = 300, orbits: int = 8) -> Any:
    return long_time.engine_drift(
        SETTING, engine=engine, tolerance=tolerance, rotations=rotations, orbits=orbits, jobs=1
    )


def test_integrals_are_energy_length_and_projection() -> None:
    s = float(scale(SETTING.moments))
    M, gamma = body_from_aligned(Aligned(*SETTING.states(3)), GENERIC.alpha0, s)
    h, half_square, along = SETTING.integrals(M, gamma)
    assert np.allclose(half_square, 0.5, rtol=1e-15)
    assert np.allclose(along, 0.2, rtol=1e-14)
    # On the separatrix without weight the energy is h0.
    assert np.allclose(h, 1, atol=float(GENERIC.mu) / (GENERIC.kappa * 1.3**2 / 2))


def test_slope_is_the_power_of_the_late_times() -> None:
    rotations = np.geomspace(1, 1e4, 61)
    row = 1e-16 * rotations**0.7 + np.where(rotations < 90, 1e-10, 0)
    power, reach = long_time._slope(rotations, row)
    assert power == pytest.approx(0.7)
    assert reach == pytest.approx(np.log(100), rel=0.05)


@needs_heyoka
def test_the_finest_tolerance_walks_at_random_and_a_coarse_one_does_not() -> None:
    assert set(verdicts(drift("taylor", 2.0**-52))) == {"passed"}
    coarse = verdicts(drift("taylor", 1e-9))
    assert coarse.count("limit") >= 3


@needs_heyoka
def test_without_its_reason_a_coarse_tolerance_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_time, "BIASED", "")
    assert "FAILED" in verdicts(drift("taylor", 1e-9))


def test_scipy_keeps_its_tolerance() -> None:
    made = drift("scipy", 1e-9, rotations=10, orbits=2)
    assert verdicts(made) == ["passed"] * 3
    assert made["curves"]["drift"].values.max() > 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("order", [2, 8])
def test_splittings_keep_energy_and_casimirs(order: int) -> None:
    made: Any = long_time.splitting_drift(SETTING, order=order, rotations=100, orbits=4)
    assert verdicts(made) == ["passed"] * 3
    energy, gamma, along = made["curves"]["drift"].values
    assert energy.max() > 1e3 * max(gamma.max(), along.max())


def test_a_method_that_is_no_poisson_map_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    class Heated:
        """A little more of everything at every step."""

        def __init__(self, *given: Any) -> None:
            self.made = splitting(*given)

        def advance(self, v: Any, h: float, steps: int) -> Any:
            return [x * (1 + 1e-6) ** steps for x in self.made.advance(v, h, steps)]

    monkeypatch.setattr(long_time, "splitting", Heated)
    made = long_time.splitting_drift(SETTING, order=2, rotations=100, orbits=2)
    assert verdicts(made) == ["FAILED"] * 3
