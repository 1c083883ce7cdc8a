"""Full disks, closed streams, names too long: one sentence, and never an internal error."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from rigidpend import render
from rigidpend.cli import common
from tests.cli.calls import REFERENCE, UNTRACED, call, short_files

FULL = Path("/dev/full")
needs_full = pytest.mark.skipif(not FULL.exists(), reason="this system has no /dev/full")

KEPT = "rigidpend.machine.cache.KeptFileWarning"


def streams(folder: Path, *arguments: str, **how: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        # What cannot be kept in the user's cache is told by a warning, and is another matter.
        [sys.executable, "-W", "error", "-W", f"ignore::{KEPT}", "-m", "rigidpend", *arguments],
        cwd=folder,
        # Python 3.11 keeps what of compiled code finds room: later processes would fail.
        env=UNTRACED | {"PYTHONDONTWRITEBYTECODE": "1"},
        text=True,
        timeout=120,
        check=False,
        **how,
    )


@pytest.mark.slow
@needs_full
def test_a_full_stdout_is_one_sentence_and_a_full_stderr_no_reason_not_to_compute(
    small: Path,
) -> None:
    with FULL.open("w") as full:
        done = streams(small, "run", "--help", stdout=full, stderr=subprocess.PIPE)
        said = done.stderr.splitlines()[-1]
        assert (done.returncode, said) == (1, "rigidpend: No space left on device")
        assert "Exception" not in done.stderr
        assert streams(small, "run", "small.yaml", stderr=full).returncode == 0
    assert (small / "results" / "small.h5").is_file()


@pytest.mark.slow
def test_closed_streams_are_no_reason_not_to_compute(small: Path) -> None:
    done = streams(small, "run", "small.yaml", preexec_fn=lambda: os.closerange(0, 3))
    assert done.returncode == 0
    assert (small / "results" / "small.h5").read_bytes().startswith(b"\x89HDF")


@pytest.mark.slow
def test_a_disk_that_is_full_for_figures_is_one_sentence(
    small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (small / "results").mkdir()
    shutil.copy(REFERENCE / "fig2.h5", small / "results")
    monkeypatch.setattr(render, "PIXELS", 300)
    with short_files(1000):
        done = call(small, "render", "fig2")
    assert done.returncode == 1
    assert done.stderr.endswith("fig2.png: cannot be written: File too large\n")
    assert [x.name for x in (small / "results").iterdir()] == ["fig2.h5"]


def test_an_error_of_ours_without_room_for_a_log_is_said() -> None:
    full = OSError(28, "No space left on device")
    said = common.sentence(ZeroDivisionError("mine"), Mock(side_effect=full))
    assert said.endswith("please report it; no log could be written: No space left on device")
