"""A working directory, and the first run of fig4 in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.calls import Done, call
from tests.config.samples import SMALL, written


@pytest.fixture(scope="package")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A working directory with a small config beside it."""
    folder = tmp_path_factory.mktemp("desk")
    written(folder, SMALL, "small.yaml")
    return folder


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A folder of a test's own with that small config alone."""
    written(tmp_path, SMALL, "small.yaml")
    return tmp_path


@pytest.fixture(scope="package")
def first(desk: Path) -> Done:
    """The first run of fig4, on one processor."""
    return call(desk, "run", "fig4", "-j", "1", "--out", "deep/results")


@pytest.fixture(scope="package")
def result(desk: Path, first: Done) -> Path:
    assert first.returncode == 0, first.stderr
    return desk / "deep" / "results" / "fig4.h5"
