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
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from rigidpend.machine.workers import PERIOD, check_stop


class Order(NamedTuple):
    """Order of measurements."""

    work: str
    """``search``, ``meeting``, ``phases`` or ``many``."""
    problems: list[str]
    methods: dict[str, list[dict[str, Any]]]
    """Entries by method, one a problem: of `knobs`, or of `knob`, `setting` and `part`."""
    sizes: dict[str, Any]
    few: int
    """Orbits of a problem that a method gets which takes one after the other."""
    repeats: int
    seconds: float
    reference: str = ""
    """A file of NumPy's arrays, named PROBLEM.NAME."""
    threads: int = 1
    numbers: tuple[int, ...] = ()
    """Numbers of orbits, ascending."""


def measured(order: Order, limit: float) -> tuple[list[dict[str, Any]], str]:
    """The measurements of an order, and how it ended: empty, or what went wrong.

    Parameters
    ----------
    order : Order
    limit : float
        Seconds after which the process is ended; what it has measured until then is kept.
    """
    with tempfile.TemporaryDirectory() as cache:
        # The cache is empty: what is compiled is compiled here, what is built is built.
        environment = {**os.environ, **limited_to(order.threads), "XDG_CACHE_HOME": cache}
        command = [sys.executable, "-m", "rigidpend.experiments.bench.measuring.worker"]
        given = json.dumps(order._asdict())
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, env=environment,
        )  # fmt: skip
        with process:
            out, err, late = _heard(process, given, limit)
    if late:
        return _lines(out), f"ended at {limit:g} s"
    said = err.strip().splitlines()
    code = process.returncode
    return _lines(out), f"failed: {said[-1] if said else code}" if code else ""


def _heard(process: subprocess.Popen[str], given: str, limit: float) -> tuple[str, str, bool]:
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
    order = Order(**json.load(sys.stdin))
    keep_to(order.threads)
    work = {"search": searched, "meeting": met, "phases": random_phases, "many": many_orbits}[
        order.work
    ]
    for line in work(order):
        print(json.dumps(line), flush=True)


def keep_to(cores: int) -> None:
    """Stay on so many processors, where the system lets a process choose."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-cores:])


def searched(order: Order) -> Iterator[dict[str, Any]]:
    """One method at each problem; first what its import cost."""
    from rigidpend.experiments.bench.measuring import methods, protocol

    [(name, tried)] = order.methods.items()
    method = methods.METHODS[name]
    before = protocol.memory()
    imported, _ = protocol.timed(lambda: [importlib.import_module(x) for x in method.libraries])
    yield {"import": imported, "memory_before": before}
    for problem, entry in zip(order.problems, tried, strict=True):
        stage, answer = _stage(order, problem), None
        answer = method.answer(problem, stage.module.KIND)
        assert answer is not None
        share = order.seconds
        try:
            for line in protocol.search(
                stage, method, answer, entry["knobs"], share, order.repeats
            ):
                yield {"problem": problem, **line}
        except Exception as error:
            # The other problems are still to be measured.
            yield {"problem": problem, "failed": f"{type(error).__name__}: {error}"}


def met(order: Order) -> Iterator[dict[str, Any]]:
    """Several methods in turn at one problem; a line each."""
    from rigidpend.experiments.bench.measuring import methods, protocol

    [problem] = order.problems
    stage = _stage(order, problem)
    trials, parts = {}, {}
    for name, [entry] in order.methods.items():
        method = methods.METHODS[name]
        answer = method.answer(problem, stage.module.KIND)
        assert answer is not None
        trials[name] = protocol.Attempt(
            method, answer, entry["setting"], entry["knob"], order.threads
        )
        parts[name] = entry.get("part", 1.0)
    found = protocol.meeting(stage, trials, parts, order.repeats, order.seconds)
    for name, line in found.items():
        yield {"method": name, **line}


def random_phases(order: Order) -> Iterator[dict[str, Any]]:
    """Wrong symbols of each method on random phases; a line a method and a start."""
    from rigidpend.experiments.bench.measuring import methods, phases

    for J1_0 in phases.starts():
        for name, [entry] in order.methods.items():
            method = methods.METHODS[name]
            make = methods.function(method.answers["routes"], 1, entry["setting"])
            counted = phases.counted(J1_0, make, entry["knob"], order.repeats, order.seconds)
            yield {"method": name, "J1_0": J1_0, **counted}


def many_orbits(order: Order) -> Iterator[dict[str, Any]]:
    """One method at ever more orbits; a line a number."""
    from rigidpend.experiments.bench.measuring import many, methods, protocol

    [(name, [entry])] = order.methods.items()
    method = methods.METHODS[name]
    answer = method.answer("many", "routes")
    assert answer is not None
    trial = protocol.Attempt(method, answer, entry["setting"], entry["knob"])
    numbers = order.numbers if trial.abreast else (order.few,)
    make = methods.function(answer, 1, entry["setting"])
    share, n_symbols = order.seconds, order.sizes["n_symbols"]
    yield from many.counted(make, entry["knob"], numbers, n_symbols, order.repeats, share)


def _stage(order: Order, problem: str) -> Any:
    import numpy as np

    from rigidpend.experiments.bench.measuring import problems, protocol
    from rigidpend.experiments.bench.measuring.tasks import Sizes

    module = problems.module(problem)
    with np.load(Path(order.reference)) as stored:
        truth = {
            name.removeprefix(f"{problem}."): stored[name]
            for name in stored.files
            if name.startswith(f"{problem}.")
        }
    return protocol.Stage(module, module.task(Sizes(**order.sizes)), truth, order.few)


if __name__ == "__main__":
    main()
