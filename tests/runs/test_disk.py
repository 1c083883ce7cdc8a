"""A disk that is really full: a small file system of the test's own, where the rights allow it."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigidpend.runs import loading, regression, runner
from tests.config.samples import written
from tests.runs.test_faults import (
    ZOOM,
    content,
    finished,
    once_more,
)

SMALL_SIZE, LARGE_SIZE = "72k", "8m"
"""Room for some parts, of 4 to 8 kB each, and not for the result; then for everything."""


def mounted(*arguments: str) -> str:
    """Call mount; what it complains of."""
    try:
        done = subprocess.run(
            ["mount", *arguments], capture_output=True, text=True, timeout=60, check=False
        )
    except OSError as error:
        return str(error)
    return done.stderr.strip() if done.returncode else ""


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A folder that is a file system of some pages."""
    folder = tmp_path / "disk"
    folder.mkdir()
    refused = mounted("-t", "tmpfs", "-o", f"size={SMALL_SIZE}", "rigidpend", str(folder))
    if refused:
        pytest.skip(f"no file system can be mounted here: {refused}")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.slow
def test_a_full_disk_is_one_sentence_and_with_more_room_the_run_goes_on(
    tmp_path: Path, disk: Path
) -> None:
    written(tmp_path, ZOOM, "zoom.yaml")
    done = finished(disk)
    assert done.returncode == 1, done.stderr
    said = done.stderr.splitlines()[-1]
    assert said.startswith("rigidpend: ")
    assert said.endswith(": cannot be written: No space left on device")
    assert "internal error" not in done.stderr
    assert content(disk) == [".zoom.parts"]
    kept = list(disk.glob(".zoom.parts/*/[!.]*.h5"))
    assert kept, "what was finished while there was room"
    assert mounted("-o", f"remount,size={LARGE_SIZE}", str(disk)) == ""
    assert f"zoom: goes on from {len(kept)} finished parts" in once_more(disk)
    assert content(disk) == ["zoom.h5"]
    loaded = loading.load(tmp_path / "zoom.yaml")
    elsewhere = tmp_path / "out"
    runner.follow(runner.plan(loaded, elsewhere), jobs=1, say=lambda _: None)
    fresh = disk / "zoom.h5"
    assert regression.verify(loaded, elsewhere / "zoom.h5", jobs=1, fresh=fresh) == []
