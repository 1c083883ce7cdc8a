"""The exact orbits of the shipped configs, and the published routes of Fig. 5 with a proof."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend import certify_codes
from rigidpend.config import catalogue
from rigidpend.results import store
from rigidpend.runs import certificates, loading
from rigidpend.runs.loading import LoadedConfig
from tests.cli.calls import REFERENCE


def orbits(name: str) -> tuple[LoadedConfig, Any]:
    config = loading.load(catalogue.known()[name])
    return config, certificates.orbits(config, REFERENCE)


def test_those_of_fig4_are_its_grids() -> None:
    _, found = orbits("fig4")
    assert {name: len(phases) for name, (_, phases) in found.items()} == {"left": 63, "right": 32}
    assert found["left"][1][3].text == "0 + ((1/10) * 3)"
    assert float(found["right"][1][31]) == pytest.approx(3 * np.pi / 40 + 0.31, abs=1e-15)


@pytest.mark.slow
def test_those_of_the_zoom_are_told_by_its_result() -> None:
    _, found = orbits("fig4_zoom")
    levels = store.load(REFERENCE / "fig4_zoom.h5")["data"]["levels"]
    assert found.keys() == levels.keys()
    for name, (_, phases) in found.items():
        level = levels[name]
        spacing = phases[1] - phases[0]
        assert float(spacing) == pytest.approx(level["step"], rel=1e-12)
        assert len(phases) == len(level["offset"])
    assert float(spacing) < 1e-11


@pytest.mark.slow
def test_the_published_routes_of_fig5_are_proven() -> None:
    stored = store.load(REFERENCE / "fig5.h5")["data"]
    for name, (problem, phases) in orbits("fig5")[1].items():
        found = certify_codes(
            problem.body, phases, h0=problem.h0, J1_0=problem.J1_0, n_symbols=problem.n_symbols
        )
        assert found.proven.all()
        assert np.array_equal(found.codes[:, 0], stored[name]["codes"])
        assert np.array_equal(found.separatrix[:, 0], stored[name]["separatrix"])
        away = np.abs(found.crossing_time[:, 0] - stored[name]["crossing_time"])
        assert (away <= found.time_radius[:, 0] + 1e-6).all()


def test_too_many_orbits_are_refused(tmp_path: Path) -> None:
    loaded = loading.load(
        catalogue.known()["fig4"], ["problem.arrays.left.count=2001", "problem.n_symbols=2"]
    )
    with pytest.raises(loading.ConfigError, match="2000 are the most"):
        certificates.orbits(loaded, tmp_path)
