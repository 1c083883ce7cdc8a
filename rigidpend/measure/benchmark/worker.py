"""One method on one problem, in a process of its own: one core, fresh memory, cold caches.

Started as ``python -m rigidpend.measure.benchmark.worker``; an :class:`Order` comes on stdin,
as JSON, and a line of JSON goes to stdout for each measurement, as soon as it is there.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "JAX_PLATFORMS": "cpu",
}


REACH = 6
"""How many budgets a size may take: it is measured once, and the last."""


class Order(NamedTuple):
    """What to measure."""

    problem: str
    method: str
    sizes: list[dict[str, Any]]
    """Of the problem; more than one where the cost is measured against them."""
    knobs: list[Any]
    repeats: int
    seconds: float
    reference: str
    """A file of NumPy's arrays; empty where only the cost counts."""


def measured(order: Order, limit: float) -> tuple[list[dict[str, Any]], str]:
    """The measurements of an order, and how it ended: empty, or what went wrong.

    Parameters
    ----------
    order : Order
    limit : float
        Seconds after which the process is ended; what it has measured until then is kept.
    """
    with tempfile.TemporaryDirectory() as cache:
        # heyoka's cache is empty: what is compiled is compiled here.
        environment = {**os.environ, **ONE_THREAD, "HEYOKA_CACHE_DIR": cache}
        command = [sys.executable, "-m", "rigidpend.measure.benchmark.worker"]
        given = json.dumps(order._asdict())
        try:
            done = subprocess.run(
                command, input=given, capture_output=True, text=True, env=environment,
                timeout=limit, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired as late:
            # Even where text is asked for, what came before the end is bytes.
            told: Any = late.stdout or b""
            return _lines(bytes(told).decode()), f"ended at {limit:g} s"
    said = done.stderr.strip().splitlines()
    ended = "" if not done.returncode else f"failed: {said[-1] if said else done.returncode}"
    return _lines(done.stdout), ended


def _lines(text: str) -> list[dict[str, Any]]:
    """The whole lines of an output."""
    found = []
    for line in text.splitlines():
        with contextlib.suppress(json.JSONDecodeError):
            found.append(json.loads(line))
    return found


def main() -> None:
    order = Order(**json.load(sys.stdin))
    keep_to_one_core()
    for line in work(order):
        print(json.dumps(line), flush=True)


def keep_to_one_core() -> None:
    """Stay on one processor, where the system lets a process choose."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def work(order: Order) -> Iterator[dict[str, Any]]:
    """The costs of import, then a measurement a knob (or a size)."""
    import numpy as np

    from rigidpend.measure.benchmark import methods, problems, protocol

    method, problem = methods.METHODS[order.method], problems.module(order.problem)
    answer = method.answer(order.problem, problem.KIND)
    assert answer is not None
    before = protocol.memory()
    imported, _ = protocol.timed(lambda: [importlib.import_module(x) for x in method.libraries])
    yield {"import": imported, "memory_before": before}
    make = methods.function(answer)
    how = protocol.Protocol(order.repeats, order.seconds)
    measure = protocol.measure_long if problem.KIND == "long" else protocol.measure
    if order.reference:
        task = problem.task(problems.Sizes(**order.sizes[0]))
        reference = dict(np.load(Path(order.reference)))
        error: Callable[[Any], Any] = lambda found: problem.error(found, reference)  # noqa: E731
        yield from measure(task, make, order.knobs, how, error)
        return
    yield from _scaled(order, lambda sizes: problem.scaled(problems.Sizes(**sizes)), make, how)


def _scaled(order: Order, task: Any, make: Any, how: Any) -> Iterator[dict[str, Any]]:
    """The cost at each size, as long as the next is expected within a few budgets."""
    from rigidpend.measure.benchmark import protocol

    last, done = 0.0, 1.0
    for sizes in order.sizes:
        size = float(sizes["columns"] * (sizes["n_symbols"] + 1))
        if last * size / done > REACH * order.seconds:
            return
        for line in protocol.measure(task(sizes), make, order.knobs, how, lambda _: {}):
            last, done = line["seconds"], size
            yield {**sizes, **line}


if __name__ == "__main__":
    main()
