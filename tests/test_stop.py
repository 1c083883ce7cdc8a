"""Real processes and real signals: a stop is a stop, whatever computes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.cli.calls import UNTRACED

PROMPT = 2.0
"""Seconds within which a run ends after a signal, when the processor is its own."""

SCRIPT = """
import signal, sys
import numpy as np
from rigidpend import Body, route_codes
from rigidpend.machine import signals
signal.signal(signal.SIGINT, signal.default_int_handler)
if WATCHED:
    # Nothing is ended by force here: work ends by itself.
    signals.GRACE = 60
    signals.watch()
body = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.001")
def codes(n, symbols, **more):
    return route_codes(body, np.arange(n) / 100, h0="1.3342", J1_0="1e-8", n_symbols=symbols,
                       jobs=JOBS, **more)
try:
    codes(JOBS, 1, MORE)
    print("at work", flush=True)
    codes(COUNT, SYMBOLS, MORE)
except signals.Stopped:
    sys.exit(128 + signals.came())
except KeyboardInterrupt:
    sys.exit(1)
"""

WORK = {
    "long codes in doubles": "63, 100_000",
    "many columns": "10_000, 300",
    "64 bits": "63, 3_000, precisions=[64]",
    "113 bits": "63, 1_000, precisions=[113]",
    "arbitrary precision": "63, 1_000, precisions=[160]",
    "DOP853": "63, 1_000, engine='scipy', precisions=[53]",
    "integers": "63, 1_000, engine='scipy', precisions=[80]",
}


def begun(work: str, jobs: int, *, watched: bool = True) -> subprocess.Popen[str]:
    """A process that is at work, as a command, or as a script of a user's own."""
    count, symbols, *more = WORK[work].split(", ")
    script = SCRIPT.replace("COUNT", count).replace("SYMBOLS", symbols)
    script = script.replace("MORE", ", ".join(more)).replace("JOBS", str(jobs))
    script = script.replace("WATCHED", str(watched))
    # Worker processes import the script that begins them: it must not compute then.
    script = "if __name__ == '__main__':\n" + "\n".join("    " + x for x in script.splitlines())
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[1],
        env=UNTRACED,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "at work\n"
    time.sleep(0.1)
    assert process.poll() is None, "it is still at work"
    return process


def ended(process: subprocess.Popen[str]) -> tuple[int, float, str]:
    """The exit code, the seconds until then, and what was said."""
    began = time.monotonic()
    try:
        _, said = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise
    return process.returncode, time.monotonic() - began, said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("work", "jobs", "number"),
    [
        *((work, 2, signal.SIGINT) for work in WORK),
        # On one thread it is the same calls that are waited for, of any work.
        *((work, 1, signal.SIGINT) for work in ("long codes in doubles", "integers")),
        ("long codes in doubles", 2, signal.SIGTERM),
    ],
)
def test_a_signal_ends_any_work_soon(work: str, jobs: int, number: signal.Signals) -> None:
    process = begun(work, jobs)
    process.send_signal(number)
    code, seconds, said = ended(process)
    assert (code, said) == (128 + number, "")
    # Other work on the machine may take its turn; without the check it is some ten times as long.
    assert seconds < PROMPT * max(1.0, os.getloadavg()[0])


@pytest.mark.slow
def test_in_a_script_ctrl_c_is_python_s_and_ends_the_threads_as_well() -> None:
    process = begun("long codes in doubles", 2, watched=False)
    process.send_signal(signal.SIGINT)
    code, seconds, said = ended(process)
    assert (code, said) == (1, "")
    assert seconds < PROMPT * max(1.0, os.getloadavg()[0])


@pytest.mark.slow
def test_signals_upon_signals_end_it_without_a_core_dump() -> None:
    process = begun("long codes in doubles", 2)
    for number in (signal.SIGINT, signal.SIGINT, signal.SIGTERM, signal.SIGINT):
        process.send_signal(number)
        time.sleep(0.01)
    code, seconds, said = ended(process)
    # Of signals that wait together any may be the first to be seen; and while Python shuts down
    # they are the system's again.
    assert code in (130, 143, -signal.SIGINT, -signal.SIGTERM)
    assert not said
    assert seconds < PROMPT * max(1.0, os.getloadavg()[0])
