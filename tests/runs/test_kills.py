"""Runs on two threads that are stopped or killed in the middle of long codes: nothing is lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rigidpend.runs import loading, regression, runner
from tests.attacks import lot
from tests.cli.calls import UNTRACED
from tests.config.samples import HEAD, written
from tests.runs.test_faults import AS_FROM_A_SHELL, CODES, content

KILLS = lot.trials(3, 0.05)
LONG = f"""\
{HEAD.format(experiment="route_codes", n_symbols=300)}\
  arrays:
    first: {{start: 0, step: 1/10, count: 16}}
    second: {{start: 1/20, step: 1/10, count: 16}}

numerics:
  precisions: [53]
"""
"""Two arrays, of which each takes some half second."""


def moment(number: int) -> float:
    """Seconds after which a run is stopped."""
    with lot.drawn(f"threads {number}") as chance:
        return chance.uniform(0, 1.0)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of a run that nobody disturbed."""
    desk = tmp_path_factory.mktemp("desk")
    loaded = loading.load(written(desk, LONG, "long.yaml"))
    runner.follow(runner.plan(loaded, desk / "out"), jobs=2, say=lambda _: None)
    return desk / "out" / "long.h5"


def disturbed(folder: Path, moment: float, how: signal.Signals) -> tuple[int, float]:
    """Run on two threads, and send a signal at a moment after the computation began.

    Returns the exit code, and the seconds from the signal to the end.
    """
    command = [sys.executable, "-m", "rigidpend", "run", str(folder.parent / "long.yaml")]
    process = subprocess.Popen(
        [sys.executable, "-I", "-S", "-c", AS_FROM_A_SHELL, *command, "--out", folder, "-j", "2"],
        env=UNTRACED,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    while process.poll() is None and not (folder / ".long.parts").exists():
        time.sleep(0.005)
    time.sleep(moment)
    process.send_signal(how)
    begun = time.monotonic()
    return process.wait(timeout=60), time.monotonic() - begun


@pytest.mark.slow
@pytest.mark.parametrize("number", range(KILLS))
def test_a_run_on_two_threads_goes_on_whenever_it_was_killed(
    tmp_path: Path, undisturbed: Path, number: int
) -> None:
    loaded = loading.load(written(tmp_path, LONG, "long.yaml"))
    out, how = tmp_path / "out", list(CODES)[number % 3]
    code, seconds = disturbed(out, moment(number), how)
    assert code in {0, *CODES[how]}
    # Other work on the machine may take its turn.
    assert seconds < 2 * max(1.0, os.getloadavg()[0])
    left = {path.suffix for path in out.rglob("*") if path.is_file()}
    assert left <= {".h5", ".log"} or how == signal.SIGKILL, "half a file"
    planned = runner.plan(loaded, out)
    # A signal may also come when the result is written and only the process still ends.
    assert code or not planned.reason
    if planned.reason:
        runner.follow(planned, jobs=2, say=lambda _: None)
    assert content(out) == ["long.h5"]
    assert regression.verify(loaded, undisturbed, jobs=1, fresh=out / "long.h5") == []
