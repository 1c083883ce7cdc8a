"""Maps and integration that contradict each other: an error that always reaches the user."""

from __future__ import annotations

import json
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from rigidpend import cli, route_codes
from rigidpend.experiments.route_map import compute
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes import codes, mapped, plane
from rigidpend.routes.certainty import Contradiction
from rigidpend.routes.plane import Plane
from rigidpend.routes.start import Scales
from tests.config.samples import HEAD, written
from tests.orbits.integrate.problems import FIG4

MAP = f"""\
{HEAD.format(experiment="route_map", n_symbols=3)}\
  theta2_0: {{ends: [1, 2], count: 8}}
  rows: {{axis: log10_J1_0, ends: [-9, -8], count: 2}}
numerics: {{precisions: [53, 106]}}
"""
PHASES = np.linspace(0.5, 6, 10)


@pytest.fixture(autouse=True)
def mirrored(monkeypatch: pytest.MonkeyPatch) -> None:
    """All maps find the mirror image of every orbit: they err alike, so that they agree."""
    real = mapped.Maps.crossings

    def alike(self: mapped.Maps, bits: int, scales: Scales, columns: Any) -> Any:
        right = real(self, bits, scales, columns)
        image = np.array([0, 1, 4, 3, 2], dtype=np.uint8)[right.separatrix]
        return right._replace(separatrix=image)

    monkeypatch.setattr(mapped.Maps, "crossings", alike)
    monkeypatch.setattr(mapped, "budget", lambda *_: math.inf)
    for module in (codes, plane, compute):
        monkeypatch.setattr(module, "MANY", 1)


@pytest.mark.parametrize("method", ["auto", "map"])
def test_codes_are_not_given_whoever_chose_the_maps(method: str) -> None:
    with pytest.raises(
        Contradiction, match=r"10 differ, the first at theta2_0 = 0\.5 and J1_0 = 1e-8"
    ):
        route_codes(FIG4, PHASES, h0="1.3342", J1_0="1e-8", n_symbols=3, method=method, jobs=2)


def test_cells_of_a_plane_are_not_given() -> None:
    made = Plane(FIG4, "1.3342", (1e-9, 1e-8), 3, resolve(None, None, (53,)), 10)
    with pytest.raises(Contradiction, match=r"theta2_0 = 0\.5 and J1_0 = 1e-09"):
        made.cells(PHASES, np.full(10, 1e-9))


@pytest.mark.slow
def test_the_command_says_it_in_a_sentence_and_stores_nothing(tmp_path: Path) -> None:
    config = written(tmp_path, MAP, "small.yaml")
    given = ["run", str(config), "--out", str(tmp_path), "--json", "--jobs", "2"]
    done = CliRunner().invoke(cli.main, given)
    [outcome] = json.loads(done.stdout)
    assert (done.exit_code, outcome["status"]) == (1, "failed")
    assert outcome["error"].startswith("return maps and integration call different symbols certain")
    assert f"rigidpend: small: {outcome['error']}" in done.stderr.splitlines()
    assert not list(tmp_path.glob("*.h5"))


def test_it_comes_unchanged_from_processes_and_clusters() -> None:
    again = pickle.loads(pickle.dumps(Contradiction("said")))
    assert (type(again), str(again)) == (Contradiction, "said")
    # Nobody who catches what a computation may refuse takes it for that.
    assert not issubclass(Contradiction, ArithmeticError | ValueError | RuntimeError | LookupError)
