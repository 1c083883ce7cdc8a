"""The complete experiment on the page for developers: added to a copy of the package, and run."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from rigidpend import Body
from tests.cli.calls import UNTRACED

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8")
BLOCK = re.compile(
    r"^```\{code-block\} \w+\n:caption: (\S+)\n\n(.*?)^```", re.MULTILINE | re.DOTALL
)
FILES = dict(BLOCK.findall(PAGE))


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with the files of the page; no line of it is edited."""
    folder = tmp_path_factory.mktemp("house")
    # What is compiled goes with it, and is found to be of these files.
    shutil.copytree(ROOT / "rigidpend", folder / "rigidpend")
    for name, content in FILES.items():
        assert not (folder / name).exists()
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content, encoding="utf-8")
    return folder


def rigidpend(house: Path, *arguments: str) -> str:
    """What a command of that copy prints; a copy does not count as covered or not."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "rigidpend", *arguments],
        cwd=house,
        env={**UNTRACED, "PYTHONPATH": str(house)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_the_example_is_short() -> None:
    assert len(FILES) == 5
    assert sum(content.count("\n") for content in FILES.values()) < 100


@pytest.mark.slow
def test_it_runs_is_drawn_and_reported(house: Path) -> None:
    assert "5 periods" in rigidpend(house, "run", "rotation")
    with h5py.File(house / "results" / "rotation.h5") as file:
        h0, period = file["data/h0"][:], file["data/period"][:]
    body = Body((2, 1, "1.5"), (1, 1, 0), 0)
    # The sum over equidistant phases of 1/(kappa J2) converges exponentially.
    phase = np.arange(4096)[:, None] * 2 * np.pi / 4096
    J2 = np.sqrt(2 * (h0 - 0.001 * np.sin(phase)) / body.kappa)
    np.testing.assert_allclose(period, 2 * np.pi * (1 / (body.kappa * J2)).mean(axis=0), rtol=1e-12)
    with pytest.raises(AssertionError, match=r"problem\.h0: h0 > mu = 0\.001 is broken"):
        rigidpend(house, "run", "rotation", "--set", "problem.h0=[1, 0.0005]")
    rigidpend(house, "report")
    assert "Rotation period" in (house / "results" / "report.html").read_text(encoding="utf-8")
