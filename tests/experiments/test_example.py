"""The complete experiment on the page for developers: added to a copy of the package, and run."""

import json
import re
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from rigidpend import Body
from tests.cli.calls import UNTRACED
from tests.processes import python

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


COMMANDS = """
import json, sys
from click.testing import CliRunner
from rigidpend.cli import main
done = [CliRunner().invoke(main, words.split(" ", 3)) for words in sys.argv[1:]]
print(json.dumps([(each.exit_code, each.output) for each in done]))
"""


def rigidpend(house: Path, *commands: str) -> list[tuple[int, str]]:
    """How commands of that copy end and what they print; a copy counts as covered in no case."""
    done = python(house, "-c", COMMANDS, *commands, env={**UNTRACED, "PYTHONPATH": str(house)})
    assert done.returncode == 0, done.stderr
    return [tuple(each) for each in json.loads(done.stdout)]


@pytest.mark.slow
def test_it_keeps_the_style_and_the_contract(house: Path) -> None:
    """Imports in their order, and what every experiment offers: as it would be asked for here."""
    shutil.copy(ROOT / "pyproject.toml", house)
    shutil.copy(ROOT / "tests" / "experiments" / "test_contract.py", house)
    pages = [str(house / name) for name in FILES if name.endswith(".py")]
    asked = ["-k", "rotation", "--noconftest", "-p", "no:cacheprovider"]
    for words in (
        ["ruff", "check", *pages],
        ["ruff", "format", "--check", *pages],
        ["pytest", "-q", "-c", "pyproject.toml", "test_contract.py", *asked],
    ):
        done = python(house, "-m", *words, env={**UNTRACED, "PYTHONPATH": str(house)})
        assert done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"


@pytest.mark.slow
def test_it_runs_is_drawn_and_reported(house: Path) -> None:
    (made, said), refused, (reported, _) = rigidpend(
        house, "run rotation", "run rotation --set problem.h0=[1, 0.0005]", "report"
    )
    assert (made, reported) == (0, 0)
    assert "5 periods" in said
    assert refused[0] == 2
    assert "problem.h0: h0 > mu = 0.001 is broken" in refused[1]
    with h5py.File(house / "results" / "rotation.h5") as file:
        h0, period = file["data/h0"][:], file["data/period"][:]
    body = Body((2, 1, "1.5"), (1, 1, 0), 0)
    # The sum over equidistant phases of 1/(kappa J2) converges exponentially.
    phase = np.arange(4096)[:, None] * 2 * np.pi / 4096
    J2 = np.sqrt(2 * (h0 - 0.001 * np.sin(phase)) / body.kappa)
    np.testing.assert_allclose(period, 2 * np.pi * (1 / (body.kappa * J2)).mean(axis=0), rtol=1e-12)
    assert "Rotation period" in (house / "results" / "report.html").read_text(encoding="utf-8")
