"""A working directory with a small config."""

from pathlib import Path

import pytest

from tests.config.samples import SMALL, written


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A folder of a test's own with a small config alone."""
    written(tmp_path, SMALL, "small.yaml")
    return tmp_path
