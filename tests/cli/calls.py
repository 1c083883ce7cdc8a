"""Commands in another folder, in this process; environments for those in one of their own."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from rigidpend import cli

REFERENCE = Path(__file__).resolve().parents[2] / "results" / "reference"
STRANGE = ("DISPLAY", "PYTHONUNBUFFERED")
OWN = {"PYTHONPATH": str(REFERENCE.parents[1])}
UNTRACED = OWN | {
    name: x for name, x in os.environ.items() if not name.startswith(("COVERAGE_", *STRANGE))
}
"""Where a program in another folder finds this package and its tests. Without a display; with
buffers, whose rest is what fails at the end on a full disk; and where coverage is not measured: it
writes files, and waits for ever for a lock of its own where a signal interrupts it with that."""

Done = subprocess.CompletedProcess[str]


def call(folder: Path, *arguments: str) -> Done:
    """A command in a folder, in this process: Python and its libraries start once for all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(sys, "argv", ["rigidpend", *arguments])
        done = CliRunner().invoke(cli.main, arguments, prog_name="rigidpend")
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    # Nothing in it is for programmers or for terminals.
    assert "Traceback" not in done.stderr, done.stderr
    assert "\x1b" not in done.output
    return Done(arguments, done.exit_code, done.stdout, done.stderr)


def started(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    """A command in a session of its own, as from a shell that waits for it."""
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "rigidpend", *arguments],
        cwd=folder,
        env=UNTRACED,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # Tests may be started in the background, where Ctrl-C is ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def succeeded(folder: Path, *arguments: str) -> Done:
    """The same, which must end well."""
    done = call(folder, *arguments)
    assert done.returncode == 0, done.stderr + done.stdout
    return done
