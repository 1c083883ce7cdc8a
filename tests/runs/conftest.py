"""A small config with its result and its reference, computed once for all tests."""

import shutil
from pathlib import Path

import pytest

from rigidpend.machine.progress import tell_nobody
from rigidpend.runs import loading, references, runner
from tests.config.samples import SMALL, written


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the config, the result and the reference, none of them to be changed."""
    desk = tmp_path_factory.mktemp("made")
    (desk / "configs").mkdir()
    loaded = loading.load(written(desk / "configs", SMALL, "small.yaml"))
    references.renew(loaded, desk / "results" / "reference" / "small.h5", "first", jobs=1)
    runner.run(runner.plan(loaded, desk / "results"), jobs=1, report=tell_nobody)
    return desk


@pytest.fixture
def desk(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same for one test alone, as the working directory."""
    shutil.copytree(made, tmp_path / "desk")
    monkeypatch.chdir(tmp_path / "desk")
    return tmp_path / "desk"
