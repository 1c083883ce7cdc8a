"""Runs that are killed, stopped, or find no room: the same command again makes all good.

How often a run is killed at a random moment: once, or as `tests.attacks.lot` says.
"""

import errno
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from rigidpend.machine import files
from rigidpend.runs import loading, references, runner
from tests.attacks import lot
from tests.cli.calls import UNTRACED, call, started
from tests.config.samples import ZOOM, written

KILLS = lot.trials(1, 0.05)


def once_more(folder: Path) -> list[str]:
    """What the same command says again, in this process, which has imported everything."""
    said: list[str] = []
    planned = runner.plan(loading.load(folder.parent / "zoom.yaml"), folder)
    if planned.reason:
        runner.follow(planned, 1, said.append)
    return said


def content(folder: Path) -> list[str]:
    """What is in a folder of results; a log belongs to a run, not to its result."""
    return sorted(path.name for path in folder.iterdir() if path.suffix != ".log")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of a run that nobody disturbed."""
    desk = tmp_path_factory.mktemp("desk")
    written(desk, ZOOM, "zoom.yaml")
    once_more(desk / "out")
    return desk / "out" / "zoom.h5"


def same(folder: Path, undisturbed: Path) -> None:
    """The folder holds exactly the result, and that is the undisturbed one, by value."""
    assert content(folder) == ["zoom.h5"]
    loaded = loading.load(undisturbed.parent.parent / "zoom.yaml")
    assert references.verify(loaded, undisturbed, jobs=1, fresh=folder / "zoom.h5") == []


LASTS = 1.6
"""Seconds from its start within which a run is killed: it takes about as long."""


@pytest.mark.slow
def test_a_killed_run_goes_on_whenever_it_was_killed(tmp_path: Path, undisturbed: Path) -> None:
    """Every moment is followed by an undisturbed run."""
    # One after the other: to open a file forks, and a child holds the locks of other threads.
    with lot.drawn("kills") as chance:
        for index in range(KILLS):
            desk = tmp_path / str(index)
            desk.mkdir()
            written(desk, ZOOM, "zoom.yaml")
            process = started(desk, "run", "zoom.yaml", "--out", "out")
            time.sleep(chance.uniform(0.3, LASTS))
            process.kill()
            process.communicate()
            assert process.returncode in (0, -9)
            once_more(desk / "out")
            # A file that was half written when the run was killed is tidied up a day later.
            for left in (desk / "out").glob(".zoom.h5.*.part"):
                os.utime(left, (0, 0))
            once_more(desk / "out")
            same(desk / "out", undisturbed)


SMALL = Path("results/small.h5")


def small() -> runner.Plan:
    """The plan of the small config, whose result is there."""
    return runner.plan(loading.load(Path("configs/small.yaml")), SMALL.parent)


def test_what_a_run_left_that_was_killed_at_its_very_end_is_tidied_up_a_day_later(
    desk: Path,
) -> None:
    out, before = SMALL.parent, content(SMALL.parent)
    parts, half = out / ".small.parts" / "old", out / ".small.h5.abc.part"
    parts.mkdir(parents=True)
    half.write_bytes(b"half")
    assert small().reason == ""
    assert all(left.exists() for left in (parts, half))
    for left in (parts, half):
        os.utime(left, (0, 0))
    assert small().reason == ""
    assert content(out) == before


@pytest.mark.slow
def test_no_room_is_one_sentence_and_afterwards_the_run_goes_on(
    tmp_path: Path, undisturbed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There is enough for the parts, not for the result."""
    written(tmp_path, ZOOM, "zoom.yaml")
    out, replace = tmp_path / "out", files.replace

    def full(path: Path, content: bytes, **how: Any) -> None:
        if path.suffix == ".h5":
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(path, content, **how)

    with monkeypatch.context() as patch:
        patch.setattr(files, "replace", full)
        done = call(tmp_path, "run", "zoom.yaml", "--out", str(out), "-j1")
    assert done.returncode == 1
    said = f"rigidpend: zoom: {out / 'zoom.h5'}: cannot be written: No space left on device\n"
    assert done.stderr.endswith(said)
    assert content(out) == [".zoom.parts"]
    assert "continues from 4 finished parts" in once_more(out)
    same(out, undisturbed)


def test_a_result_in_a_read_only_folder_stays_up_to_date(
    desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refuse = Mock(side_effect=OSError(errno.EROFS, "Read-only file system"))
    config = small().config
    (SMALL.parent / ".small.h5.abc.part").write_bytes(b"half")
    os.utime(SMALL.parent / ".small.h5.abc.part", (0, 0))
    for function in ("unlink", "mkdir", "replace", "rmdir"):
        monkeypatch.setattr(os, function, refuse)
    assert runner.plan(config, SMALL.parent).reason == ""


WORK = """
import time
def work(part):
    print("at work", flush=True)
    time.sleep(30)
if __name__ == "__main__":
    import script
    from rigidpend.machine.workers import side_by_side
    side_by_side(script.work, (), True, [0, 1], 2)
"""


@pytest.mark.slow
def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    """Else each killed run would leave processes that wait for ever."""
    how: Any = {"env": UNTRACED, "cwd": tmp_path, "stdout": subprocess.PIPE, "text": True}
    script = written(tmp_path, WORK, "script.py")
    with subprocess.Popen([sys.executable, script], **how) as parent:
        assert parent.stdout is not None
        assert [parent.stdout.readline() for _ in range(2)] == ["at work\n"] * 2
        parent.kill()
        # It is theirs too, and closed when all of them have ended.
        parent.communicate(timeout=10)
