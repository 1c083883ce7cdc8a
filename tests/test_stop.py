"""Real processes and real signals: a stop is a stop, whatever computes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.cli.calls import UNTRACED

PROMPT = 2.0
"""Seconds within which a run ends after a signal, when the processor is its own."""

SCRIPT = """
import json, signal, sys
import numpy as np
from rigidpend import Body, route_codes
from rigidpend.machine import signals
body = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.001")
works, jobs, watched = json.loads(sys.argv[1])
signal.signal(signal.SIGINT, signal.default_int_handler)
# Nothing is ended by force here: work ends by itself.
signals.GRACE = 600
def codes(n, symbols, more):
    return route_codes(body, np.arange(n) / 100, h0="1.3342", J1_0="1e-8", n_symbols=symbols,
                       jobs=jobs, **more)
# Worker processes import the script that begins them: it must not compute then.
if __name__ == "__main__":
    for count, symbols, more in works:
        if watched:
            signals.watch()
        try:
            codes(jobs, 1, more)
            print("at work", flush=True)
            codes(count, symbols, more)
            sys.exit("no signal ended it")
        except signals.Stopped:
            code = 128 + signals.came()
            print("stopped", flush=True)
            signals._came.clear()
        except KeyboardInterrupt:
            sys.exit(1)
    sys.exit(code)
"""

LONG: Any = (63, 100_000, {})
WORK: dict[int, list[Any]] = {
    2: [
        LONG,
        (10_000, 300, {}),
        (63, 3_000, {"precisions": [64]}),
        (63, 1_000, {"precisions": [113]}),
        (63, 1_000, {"precisions": [160]}),
        # In processes.
        (63, 1_000, {"engine": "scipy", "precisions": [53]}),
    ],
    # On one thread it is the same calls that are waited for, of any work.
    1: [LONG, (63, 1_000, {"engine": "scipy", "precisions": [80]})],
}
"""Work of any kind, by its threads: columns, symbols, and how they are computed."""


def begun(works: list[Any], jobs: int, *, watched: bool = True) -> subprocess.Popen[str]:
    """A process that does some works in turn, as a command, or as a script of a user's own."""
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT, json.dumps((works, jobs, watched))],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[1],
        env=UNTRACED,
    )


def signalled(process: subprocess.Popen[str], *numbers: signal.Signals) -> float:
    """Send signals to a process when it is at work; the seconds until it says or does something."""
    assert process.stdout is not None
    assert process.stdout.readline() == "at work\n"
    time.sleep(0.1)
    assert process.poll() is None, "it is still at work"
    began = time.monotonic()
    for number in numbers:
        process.send_signal(number)
        time.sleep(0.01)
    process.stdout.readline()
    return time.monotonic() - began


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    try:
        _, said = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise
    return process.returncode, said


def prompt() -> float:
    """Other work on the machine may take its turn; without a check it is some ten times as long."""
    return PROMPT * max(1.0, os.getloadavg()[0])


@pytest.mark.slow
@pytest.mark.parametrize(("jobs", "number"), [(2, signal.SIGINT), (1, signal.SIGTERM)])
def test_a_signal_ends_any_work_soon(jobs: int, number: signal.Signals) -> None:
    process = begun(WORK[jobs], jobs)
    taken = [signalled(process, number) for _ in WORK[jobs]]
    assert ended(process) == (128 + number, "")
    assert max(taken) < prompt(), taken


@pytest.mark.slow
def test_in_a_script_ctrl_c_is_python_s_and_ends_the_threads_as_well() -> None:
    process = begun([LONG], 2, watched=False)
    taken = signalled(process, signal.SIGINT)
    assert ended(process) == (1, "")
    assert taken < prompt()


@pytest.mark.slow
def test_signals_upon_signals_end_it_without_a_core_dump() -> None:
    process = begun([LONG], 2)
    taken = signalled(process, *(signal.SIGINT, signal.SIGINT, signal.SIGTERM, signal.SIGINT))
    code, said = ended(process)
    # Of signals that wait together any may be the first to be seen; and while Python shuts down
    # they are the system's again.
    assert code in (130, 143, -signal.SIGINT, -signal.SIGTERM)
    assert not said
    assert taken < prompt()
