"""Ctrl-C and SIGTERM to commands: none is lost, each ends the process soon and in good order.

Two are sent at random moments, or more by `make attacks`.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import pytest

from rigidpend.machine import signals
from tests.attacks.lot import drawn, trials
from tests.cli.calls import UNTRACED, call
from tests.config.samples import SMALL, written

BOUND = 2.0
"""Seconds within which a command ends after a signal, when the processor is its own."""
BOTH = [signal.SIGINT, signal.SIGTERM]
SAID = {
    signal.SIGINT: "interrupted; finished results are kept",
    signal.SIGTERM: "terminated; finished results are kept",
}
LONG = ("run", "fig4", "--set", "problem.n_symbols=9999", "--set", "numerics.precisions=[53]")
"""A command that takes some seconds."""

PROGRAM = """
import os, runpy, signal, sys, time, weakref
from rigidpend.machine import files
from rigidpend.runs import runner
number, run = signal.Signals(int(sys.argv.pop(1))), runner.run
# Tests may be started in the background, where Ctrl-C is ignored; their programs are not.
signal.signal(signal.SIGINT, signal.default_int_handler)
class Dying:
    pass
def come(*_):
    os.kill(os.getpid(), number)
    # A handler runs between two instructions: here is room for it.
    for _ in range(1000):
        pass
def disturbed(*given, **named):
    dying = Dying()
    kept = weakref.ref(dying, REFERENCE)
    del dying
    return run(*given, **named)
replace = os.replace
def hanging(written, path):
    if "small" not in str(path):
        return replace(written, path)
    while True:
        try:
            come()
            time.sleep(60)
        except BaseException:
            pass
CHANGE
runpy.run_module("rigidpend", run_name="__main__", alter_sys=True)
"""
DISTURBED = "runner.run = disturbed"
HANGING = "files.os.replace = hanging"
SWALLOWS = {
    "a destructor": PROGRAM.replace("REFERENCE", "None").replace(
        "CHANGE", f"Dying.__del__ = come; {DISTURBED}"
    ),
    "a weak reference": PROGRAM.replace("REFERENCE", "come").replace("CHANGE", DISTURBED),
}


COMMANDS = {
    "run on one thread": ("run", "work.yaml", "--force", "-j", "1"),
    "run on two threads": ("run", "work.yaml", "--force", "-j", "2"),
    "run on two processes": ("run", "whole.yaml", "--force", "-j", "2"),
    "render": ("render", "results/work.h5"),
    "verify on one thread": ("verify", "work.yaml", "--reference", "results", "-j", "1"),
    "verify on two threads": ("verify", "work.yaml", "--reference", "results", "-j", "2"),
    "certify in one process": ("certify", "small.yaml", "--force", "-j", "1"),
    "certify in two processes": ("certify", "small.yaml", "--force", "-j", "2"),
    "find": ("find", "fig4", "--code", "0001101"),
    "report": ("report",),
}
"""Commands of a second or some, in a folder with their configs and results."""
LASTS = 3.0
"""Seconds from their start within which signals are sent."""


class End(NamedTuple):
    """How a process ended."""

    code: int
    seconds: float
    said: str


def ended(script: str, *given: str) -> End:
    """A script that calls a command and sends itself a signal."""
    begun = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-c", script, *given],
        env=UNTRACED,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    return End(done.returncode, time.monotonic() - begun, done.stderr)


@pytest.mark.slow
@pytest.mark.parametrize(("where", "number"), [*zip(SWALLOWS, BOTH, strict=True)])
def test_a_signal_is_heeded_that_comes_where_python_swallows_exceptions(
    tmp_path: Path, where: str, number: signal.Signals
) -> None:
    end = ended(SWALLOWS[where], str(int(number)), *LONG, "--out", str(tmp_path))
    assert (end.code, end.said.splitlines()[-1]) == (128 + number, SAID[number])
    assert "Traceback" not in end.said
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.slow
def test_a_command_that_does_not_end_by_itself_is_ended_and_leaves_no_half_file(
    tmp_path: Path,
) -> None:
    written(tmp_path, SMALL, "small.yaml")
    script = PROGRAM.replace("REFERENCE", "None").replace("CHANGE", HANGING)
    given = ("run", str(tmp_path / "small.yaml"), "--out", str(tmp_path / "out"))
    end = ended(script, str(int(signal.SIGTERM)), *given)
    assert (end.code, end.said.splitlines()[-1]) == (143, SAID[signal.SIGTERM])
    assert {path.suffix for path in tmp_path.rglob("*") if path.is_file()} == {".yaml", ".log"}


@pytest.mark.slow
def test_what_a_shell_lets_be_ignored_is_ignored(tmp_path: Path) -> None:
    written(tmp_path, SMALL, "small.yaml")
    change = f"signal.signal(signal.SIGINT, signal.SIG_IGN); Dying.__del__ = come; {DISTURBED}"
    script = PROGRAM.replace("REFERENCE", "None").replace("CHANGE", change)
    given = ("run", str(tmp_path / "small.yaml"), "--out", str(tmp_path / "out"))
    assert ended(script, str(int(signal.SIGINT)), *given).code == 0
    assert (tmp_path / "out" / "small.h5").is_file()


@pytest.mark.parametrize("number", BOTH)
def test_a_command_asked_to_end_says_so_and_prints_its_document(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    written(tmp_path, SMALL, "small.yaml")
    monkeypatch.setattr(signals, "_came", [number])
    monkeypatch.setattr(signals, "_told", [])
    done = call(tmp_path, "run", "small.yaml", "--json")
    assert (done.returncode, done.stderr) == (128 + number, f"{SAID[number]}\n")
    assert json.loads(done.stdout) == {"error": SAID[number], "exit_code": 128 + number}


def test_a_program_that_calls_the_package_keeps_its_own_handlers(tmp_path: Path) -> None:
    before = [signal.getsignal(number) for number in BOTH]
    written(tmp_path, SMALL, "small.yaml")
    assert call(tmp_path, "run", "small.yaml").returncode == 0
    assert [signal.getsignal(number) for number in BOTH] == before
    assert signal.set_wakeup_fd(-1) == -1


@pytest.mark.slow
def test_processes_are_begun_deaf_to_both_signals(tmp_path: Path) -> None:
    """Python's own tracker of resources lets signals in again when it starts: not then."""
    script = tmp_path / "script.py"
    script.write_text(
        "import multiprocessing, os, signal\n"
        "from rigidpend.machine.signals import kept_from_children\n"
        "if __name__ == '__main__':\n"
        "    with kept_from_children():\n"
        "        child = multiprocessing.get_context('spawn').Process(target=os.getpid)\n"
        "        child.start()\n"
        "        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, [])\n"
        "        deaf = {signal.SIGINT, signal.SIGTERM} <= blocked\n"
        "    assert deaf\n"
        "    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])\n"
        "    child.join()\n"
    )
    root = str(Path(__file__).resolve().parents[2])
    environment = {**os.environ, "PYTHONPATH": root}
    subprocess.run([sys.executable, script], env=environment, check=True, timeout=60)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for the commands, where each has ended well once."""
    found = tmp_path_factory.mktemp("desk")
    prepare(found)
    return found


def prepare(folder: Path) -> None:
    """Put there what the commands need."""
    longer = SMALL.replace("n_symbols: 3", "n_symbols: 200")
    written(folder, longer.replace("count: 5", "count: 63"), "work.yaml")
    whole = SMALL.replace("precisions: [53]", "engine: scipy\n  precisions: [53, 113]")
    for name, text in (("small", SMALL), ("whole", whole)):
        written(folder, text, f"{name}.yaml")
    assert call(folder, "run", "work.yaml", "small.yaml").returncode == 0


def disturbed(folder: Path, command: str, number: signal.Signals, moment: float) -> End:
    """Send a signal at a moment after a command's start, in seconds, to all of its processes."""
    process = subprocess.Popen(
        [sys.executable, "-m", "rigidpend", *COMMANDS[command]],
        cwd=folder,
        env=UNTRACED,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # Tests may be started in the background, where Ctrl-C is ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    time.sleep(moment)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, number)
    begun = time.monotonic()
    _, said = process.communicate(timeout=60)
    return End(process.returncode, time.monotonic() - begun, said)


def wrong(folder: Path, end: End, number: signal.Signals) -> str:
    """What is wrong with an end, in words; empty if it is as it should be."""
    # While Python itself begins, Ctrl-C is its own exception: nothing of ours has run.
    if (
        end.code in (1, -number)
        and "KeyboardInterrupt" in end.said
        and "rigidpend/cli" not in end.said
    ):
        return ""
    if end.code not in (0, 128 + number, -number):
        return f"exit code {end.code}"
    if "Traceback" in end.said or "Exception" in end.said:
        return "a traceback"
    if end.code == 128 + number and end.said.splitlines()[-1:] != [SAID[number]]:
        return "not said"
    return "half a file" if list(folder.rglob("*.part")) else ""


@pytest.mark.slow
@pytest.mark.parametrize("index", range(trials(2, 0.05)))
def test_a_signal_at_any_moment_ends_any_command(desk: Path, index: int) -> None:
    with drawn(f"signal {index}") as chance:
        command, number = list(COMMANDS)[index % len(COMMANDS)], chance.choice(BOTH)
        end = disturbed(desk, command, number, chance.uniform(0, LASTS))
        assert not wrong(desk, end, number), (command, number, end)
        # Other work on the machine may take its turn.
        assert end.seconds < BOUND * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
