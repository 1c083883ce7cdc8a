"""Measurements in a process of their own: fresh memory, cold caches, libraries of one thread.

Started as ``python -m rigidpend.experiments.bench.worker``; the name of its work with
its arguments comes on stdin, as JSON, and a line of JSON goes to stdout for each measurement, as
soon as it is there.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any

from rigidpend.machine.workers import PERIOD, check_stop

FAILED = 3
"""Exit code of a worker whose method failed."""
ALONE = {
    **dict.fromkeys(
        ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
    ),
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "JAX_PLATFORMS": "cpu",
}
"""The environment that leaves threads to whoever shares the orbits among them."""


class Fault(Exception):
    """A worker stopped for a fault of the benchmark itself: nothing that it measures counts."""


def measured(work: str, given: dict[str, Any], limit: float) -> tuple[list[dict[str, Any]], str]:
    """The lines that a worker tells of its work, and how it ended: empty, or what went wrong.

    Parameters
    ----------
    work : {"search", "meeting", "phases", "many", "bodies"}
    given : dict
        Arguments of the function of that work, as JSON can hold them.
    limit : float
        Seconds after which the process is ended; what it has measured until then is kept.

    Raises
    ------
    Fault
        The worker met what no method may raise.
    """
    with tempfile.TemporaryDirectory() as cache:
        # The cache is empty: what is compiled is compiled here, what is built is built.
        environment = {**os.environ, **ALONE, "XDG_CACHE_HOME": cache}
        process = subprocess.Popen(
            [sys.executable, "-m", "rigidpend.experiments.bench.worker"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, env=environment,
        )  # fmt: skip
        with process:
            out, err, late = heard(process, json.dumps([work, given]), limit)
    if late:
        return _lines(out), f"ended at {limit:g} s"
    code, said = process.returncode, (err.strip().splitlines() or [""])[-1]
    # A library may crash, which ends the process by a signal.
    if code in (0, FAILED) or code < 0:
        return _lines(out), f"failed: {said or f'signal {-code}'}" if code else ""
    raise Fault(f"the benchmark's worker stopped ({', '.join(given['entries'])}): {said or code}")


def heard(process: subprocess.Popen[str], given: str, limit: float) -> tuple[str, str, bool]:
    """Words of a process on stdout and stderr, and whether it had to be ended at the limit."""
    until = time.monotonic() + limit
    asked: str | None = given
    try:
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                out, err = process.communicate(asked, timeout=PERIOD)
                # A signal may be sent to both: then it failed for nothing of its own.
                check_stop()
                return out, err, False
            asked = None
            check_stop()
            if time.monotonic() > until:
                process.kill()
                return *process.communicate(), True
    finally:
        process.kill()


def _lines(text: str) -> list[dict[str, Any]]:
    """The whole lines of an output."""
    found = []
    for line in text.splitlines():
        with contextlib.suppress(json.JSONDecodeError):
            found.append(json.loads(line))
    return found


def main() -> None:
    """Do a work; end with a sentence where that fails."""
    # Here, for whoever starts a worker computes nothing.
    from rigidpend.experiments.bench import counts, protocol

    works: dict[str, Any] = {
        "search": protocol.search,
        "meeting": protocol.meeting,
        "phases": counts.random_phases,
        "many": counts.many_orbits,
        "bodies": counts.bodies,
    }
    work, given = json.load(sys.stdin)
    try:
        for line in works[work](**given):
            print(json.dumps(line), flush=True)
    except protocol.FAILURES as error:
        print(protocol.said(error), file=sys.stderr)
        sys.exit(FAILED)
    except Exception as error:  # noqa: BLE001
        # With the place in the package where it rose.
        frames = traceback.extract_tb(error.__traceback__)
        own = [x for x in frames if "rigidpend" in Path(x.filename).parts][-1]
        place = f" ({Path(own.filename).name}, line {own.lineno})"
        print(protocol.said(error) + place, file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
