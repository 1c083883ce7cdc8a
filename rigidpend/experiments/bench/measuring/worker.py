"""Measurements in a process of their own: one core or two, fresh memory, cold caches.

Started as ``python -m rigidpend.experiments.bench.measuring.worker``; an :class:`Order` comes on
stdin, as JSON, and a line of JSON goes to stdout for each measurement, as soon as it is there.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

from rigidpend.machine.workers import PERIOD, check_stop

FAILURES = (ArithmeticError, ImportError, MemoryError, RuntimeError, ValueError)
"""Errors that a method may raise: it found no number, its library is not there or refuses.

Whatever else is raised is a fault of this package's own lines."""
FAILED = 3
"""Exit code of a worker whose method failed."""


class Fault(Exception):
    """A worker stopped for a fault of the benchmark itself: nothing that it measures counts."""


class Order(NamedTuple):
    """Order of measurements."""

    work: str
    """``search``, ``meeting``, ``phases``, ``many`` or ``bodies``."""
    methods: dict[str, list[dict[str, Any]]]
    """Entries by method, one a problem: of `knobs`, or of `knob`, `setting` and `part`."""
    sizes: dict[str, Any]
    """Sizes of the problems: those of `schema.Workload` or `schema.Bodies`, by name."""
    repeats: int
    seconds: float
    problems: tuple[str, ...] = ()
    truth: dict[str, dict[str, Any]] = {}  # noqa: RUF012
    """Arrays by problem and name, as lists."""
    threads: int = 1
    numbers: tuple[int, ...] = ()
    """Numbers of orbits, or of bodies in their list, ascending."""


def measured(order: Order, limit: float) -> tuple[list[dict[str, Any]], str]:
    """The measurements of an order, and how it ended: empty, or what went wrong.

    Parameters
    ----------
    order : Order
    limit : float
        Seconds after which the process is ended; what it has measured until then is kept.

    Raises
    ------
    Fault
        The worker met what no method may raise.
    """
    with tempfile.TemporaryDirectory() as cache:
        # The cache is empty: what is compiled is compiled here, what is built is built.
        environment = {**os.environ, **limited_to(order.threads), "XDG_CACHE_HOME": cache}
        command = [sys.executable, "-m", "rigidpend.experiments.bench.measuring.worker"]
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, env=environment,
        )  # fmt: skip
        with process:
            out, err, late = heard(process, json.dumps(order._asdict()), limit)
    if late:
        return _lines(out), f"ended at {limit:g} s"
    code, said = process.returncode, (err.strip().splitlines() or [""])[-1]
    # A library may crash, which ends the process by a signal.
    if code in (0, FAILED) or code < 0:
        return _lines(out), f"failed: {said or f'signal {-code}'}" if code else ""
    raise Fault(f"the benchmark's worker stopped ({', '.join(order.methods)}): {said or code}")


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


def limited_to(threads: int) -> dict[str, str]:
    """The environment that keeps libraries to so many threads."""
    count = str(threads)
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
    flags = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    one = {"XLA_FLAGS": flags} if threads == 1 else {}
    return {**dict.fromkeys(names, count), **one, "JAX_PLATFORMS": "cpu"}


def _lines(text: str) -> list[dict[str, Any]]:
    """The whole lines of an output."""
    found = []
    for line in text.splitlines():
        with contextlib.suppress(json.JSONDecodeError):
            found.append(json.loads(line))
    return found


def main() -> None:
    """Do an order; end with a sentence where that fails."""
    order = Order(**json.load(sys.stdin))
    keep_to(order.threads)
    works = {
        "search": searched, "meeting": met, "phases": random_phases, "many": many_orbits,
        "bodies": bodies,
    }  # fmt: skip
    try:
        for line in works[order.work](order):
            print(json.dumps(line), flush=True)
    except Exception as error:  # noqa: BLE001
        print(_said(error), file=sys.stderr)
        sys.exit(FAILED if isinstance(error, FAILURES) else 1)


def _said(error: Exception) -> str:
    """An error in one line, with the place in the package where it rose."""
    text = f"{type(error).__name__}: {' '.join(str(error).split())}"
    if isinstance(error, FAILURES):
        return text
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "rigidpend" in Path(frame.filename).parts]
    return f"{text} ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else text


def keep_to(cores: int) -> None:
    """Stay on so many processors, where the system lets a process choose."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-cores:])


def searched(order: Order) -> Iterator[dict[str, Any]]:
    """One method at each problem; first what its import cost."""
    from rigidpend.experiments.bench.measuring import protocol
    from rigidpend.experiments.bench.methods import METHODS

    [(name, tried)] = order.methods.items()
    before = protocol.memory()
    imported, _ = protocol.timed(
        lambda: [importlib.import_module(x) for x in METHODS[name].libraries]
    )
    yield {"import": imported, "memory_before": before}
    for problem, entry in zip(order.problems, tried, strict=True):
        stage = _stage(order, problem)
        try:
            for line in protocol.search(stage, name, entry["knobs"], order.seconds, order.repeats):
                yield {"problem": problem, **line}
        except FAILURES as error:
            # The other problems are still to be measured.
            yield {"problem": problem, "failed": _said(error)}


def met(order: Order) -> Iterator[dict[str, Any]]:
    """Several methods in turn at one problem; a line each."""
    from rigidpend.experiments.bench.measuring import protocol

    [problem] = order.problems
    entries = {name: entry for name, [entry] in order.methods.items()}
    given = order.threads, order.repeats, order.seconds
    for name, line in protocol.meeting(_stage(order, problem), entries, *given).items():
        yield {"method": name, **line}


def random_phases(order: Order) -> Iterator[dict[str, Any]]:
    """Wrong symbols of one method on random phases; a line a start."""
    from rigidpend.experiments.bench.measuring import counts

    make = _make(order)
    for J1_0 in counts.starts():
        line = counts.on_random_phases(J1_0, make, order.repeats, order.seconds)
        yield {"J1_0": J1_0, **line}


def many_orbits(order: Order) -> Iterator[dict[str, Any]]:
    """One method at ever more orbits; a line a number."""
    from rigidpend.experiments.bench.measuring import counts

    given = order.numbers, order.sizes["n_symbols"], order.repeats, order.seconds
    yield from counts.on_ever_more_orbits(_make(order), *given)


def bodies(order: Order) -> Iterator[dict[str, Any]]:
    """All methods with some of the bodies of a list; a line a body."""
    from rigidpend.experiments.bench import drawn
    from rigidpend.experiments.bench.measuring import counts

    every = drawn.drawn(order.sizes["seed"], order.sizes["bodies"])
    some = [every[k] for k in order.numbers]
    entries = {name: entry for name, [entry] in order.methods.items()}
    given = order.sizes["orbits"], order.threads, order.repeats, order.seconds
    yield from counts.of_bodies(some, entries, *given, order.sizes["longest"])


def _make(order: Order) -> Any:
    """The function that makes an order's one method ready for a task."""
    from rigidpend.experiments.bench.measuring.adapters import made

    [(name, [entry])] = order.methods.items()
    return lambda task: made(name, task, entry, order.threads)


def _stage(order: Order, problem: str) -> Any:
    import numpy as np

    from rigidpend.experiments.bench.measuring import problems, protocol

    asked = problems.ASKED[problem]
    truth = {name: np.array(values) for name, values in order.truth[problem].items()}
    task = asked.task(SimpleNamespace(**order.sizes))
    return protocol.Stage(task, truth, asked.error, problem == "long_time")


if __name__ == "__main__":
    main()
