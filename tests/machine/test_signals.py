"""Ctrl-C and SIGTERM to commands: none is lost, each ends the process soon and in good order.

Two are sent at random moments, or more by `make attacks`.
"""

import contextlib
import json
import os
import signal
import time
from pathlib import Path

import pytest

from tests.attacks.lot import drawn, trials
from tests.cli.calls import UNTRACED, call, started
from tests.config.samples import SMALL, changed, written
from tests.processes import python

BOUND = 2.0
"""Seconds within which a command ends after a signal, when the processor is its own."""
BOTH = [signal.SIGINT, signal.SIGTERM]
SAID = {
    signal.SIGINT: "interrupted; finished results are kept",
    signal.SIGTERM: "terminated; finished results are kept",
}
LONG = ("run", "fig4", "--set", "problem.n_symbols=9999", "--set", "numerics.precisions=[53]")
"""A command that takes some seconds."""
SOON = ("run", "small.yaml")

PROGRAM = """
import os, runpy, signal, sys, time
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
    Dying()
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
IGNORED = "signal.signal(signal.SIGINT, signal.SIG_IGN); "
DESTRUCTOR = "Dying.__del__ = come; runner.run = disturbed"
HANGING = "files.os.replace = hanging"


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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "number", "command", "left"),
    [
        (DESTRUCTOR, signal.SIGINT, LONG, {".log"}),
        (HANGING, signal.SIGTERM, SOON, {".log"}),
        (IGNORED + DESTRUCTOR, signal.SIGINT, SOON, {".log", ".h5"}),
    ],
)
def test_a_signal_is_heeded_also_where_python_swallows_exceptions(
    tmp_path: Path, change: str, number: signal.Signals, command: tuple[str, ...], left: set[str]
) -> None:
    """A command that does not end by itself is ended; what a shell lets be ignored is ignored."""
    written(tmp_path, SMALL, "small.yaml")
    given = (PROGRAM.replace("CHANGE", change), str(int(number)), *command)
    done = python(tmp_path, "-c", *given, env=UNTRACED)
    ended = (128 + number, SAID[number]) if ".h5" not in left else (0, "")
    assert (done.returncode, done.stderr.splitlines()[-1] if ended[0] else "") == ended
    assert "Traceback" not in done.stderr
    found = {path.suffix for path in tmp_path.rglob("*") if path.is_file()}
    assert found == {".yaml", *left}


ASKED = """
from rigidpend import cli
from rigidpend.machine import signals
signals.came = lambda: 15
cli.main(["cache", "--json"])
"""


def test_a_command_asked_to_end_says_so_and_prints_its_document(tmp_path: Path) -> None:
    """One that by itself looks nowhere whether it is to end."""
    done = python(tmp_path, "-c", ASKED, env=UNTRACED)
    assert (done.returncode, done.stderr) == (143, f"{SAID[signal.SIGTERM]}\n")
    assert json.loads(done.stdout) == {"error": SAID[signal.SIGTERM], "exit_code": 143}


LATER = """
import os, time
from rigidpend.machine import signals
for _ in range(2):
    signals.conclude(2, print, patience=0.1)
signals.watch()
os.kill(os.getpid(), 15)
while not signals.came():
    time.sleep(0.01)
time.sleep(0.3)
for _ in range(2):
    signals.conclude(15, print, patience=0.1)
"""


def test_work_has_time_to_end_by_itself_and_a_signal_is_told_once(tmp_path: Path) -> None:
    """What ends a command without one, as an exception does, is told whenever it does."""
    done = python(tmp_path, "-c", LATER, env=UNTRACED)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [SAID[signal.SIGINT]] * 2 + [SAID[signal.SIGTERM]]


def test_a_program_that_calls_the_package_keeps_its_own_handlers(tmp_path: Path) -> None:
    before = [signal.getsignal(number) for number in BOTH]
    written(tmp_path, SMALL, "small.yaml")
    assert call(tmp_path, "run", "small.yaml").returncode == 0
    assert [signal.getsignal(number) for number in BOTH] == before
    assert signal.set_wakeup_fd(-1) == -1


@pytest.mark.slow
def test_processes_are_begun_deaf_to_both_signals(tmp_path: Path) -> None:
    """Python's own tracker of resources lets signals in again when it starts: not then."""
    script = """
import multiprocessing, os, signal
from rigidpend.machine.signals import kept_from_children
both = {signal.SIGINT, signal.SIGTERM}
if __name__ == '__main__':
    with kept_from_children():
        child = multiprocessing.get_context('spawn').Process(target=os.getpid)
        child.start()
        with kept_from_children():
            pass
        assert both <= signal.pthread_sigmask(signal.SIG_BLOCK, [])
    assert not both & signal.pthread_sigmask(signal.SIG_BLOCK, [])
    child.join()
"""
    done = python(tmp_path, written(tmp_path, script, "script.py").name, env=UNTRACED)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("desk")
    longer = changed("n_symbols: 3", "n_symbols: 200", changed("count: 5", "count: 63", SMALL))
    whole = changed("precisions: [53]", "engine: scipy\n  precisions: [53, 113]", SMALL)
    for name, text in (("work", longer), ("small", SMALL), ("whole", whole)):
        written(folder, text, f"{name}.yaml")
    assert call(folder, "run", "work.yaml", "small.yaml").returncode == 0
    return folder


def wrong(folder: Path, command: str, number: signal.Signals, moment: float) -> str:
    """Send a signal to a command, so many seconds after its start; what is wrong with its end."""
    process = started(folder, *COMMANDS[command])
    time.sleep(moment)
    with contextlib.suppress(ProcessLookupError):
        # To all of its processes.
        os.killpg(process.pid, number)
    begun = time.monotonic()
    _, said = process.communicate(timeout=60)
    taken, code = time.monotonic() - begun, process.returncode
    # While Python itself begins, Ctrl-C is its own exception: nothing of ours has run. It even
    # loses one that comes while it imports a module of its own.
    if "KeyboardInterrupt" in said and "rigidpend/cli" not in said:
        lost = code == 0 and said.startswith("'import warnings' failed")
        if lost or code in (1, -number):
            return ""
    if code not in (0, 128 + number, -number) or "Traceback" in said or "Exception" in said:
        return f"exit code {code}: {said}"
    if code == 128 + number and said.splitlines()[-1:] != [SAID[number]]:
        return f"not said: {said}"
    # Other work on the machine may take its turn.
    if taken > BOUND * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1)):
        return f"{taken} s"
    return "half a file" if list(folder.rglob("*.part")) else ""


@pytest.mark.slow
def test_signals_upon_signals_end_it_without_a_core_dump(desk: Path) -> None:
    process = started(desk, *LONG)
    while not list(desk.glob("results/fig4.log")):
        time.sleep(0.01)
    for number in (signal.SIGINT, *reversed(BOTH), signal.SIGINT):
        process.send_signal(number)
        time.sleep(0.01)
    _, said = process.communicate(timeout=60)
    # Of signals that wait together any may be the first to be seen; and while Python shuts down
    # they are the system's again.
    assert process.returncode in (130, 143, *(-number for number in BOTH))
    assert "Traceback" not in said


@pytest.mark.slow
@pytest.mark.parametrize("index", range(trials(2, 0.05)))
def test_a_signal_at_any_moment_ends_any_command(desk: Path, index: int) -> None:
    with drawn(f"signal {index}") as chance:
        command, number = list(COMMANDS)[index % len(COMMANDS)], chance.choice(BOTH)
        said = wrong(desk, command, number, chance.uniform(0, LASTS))
        assert not said, (command, number, said)
