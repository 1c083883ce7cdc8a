"""A working directory with a small config."""

from pathlib import Path

import pytest

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
