"""Parts computed by a real scheduler and its worker processes, which come and go."""

import contextlib
import importlib.util
import itertools
import json
import logging
import os
import pickle
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import experiments
from rigidpend.experiments.contract import Piece
from rigidpend.experiments.data import Tree
from rigidpend.experiments.route_map import compute
from rigidpend.machine.progress import PartDone, tell_nobody
from rigidpend.machine.workers import WorkerError
from rigidpend.results import store
from rigidpend.runs import certificate_files, cluster, loading, runner
from rigidpend.runs.parts import Parts
from tests.cli.calls import call
from tests.config.samples import HEAD, SMALL, written

MAP = f"""\
{HEAD.format(experiment="route_map", n_symbols=4)}\
  theta2_0: {{ends: [0, 2*pi], count: 12}}
  rows: {{axis: log10_J1_0, ends: [-10, -5], count: 12}}

numerics:
  precisions: [53]
"""
"""Twelve tiles of a row each, a tenth of a second together."""


class Dask:
    """A scheduler and its workers, processes of this test."""

    def __init__(self, folder: Path) -> None:
        self.file, self.log = folder / "scheduler.json", (folder / "dask.log").open("wb")
        self.processes: list[subprocess.Popen[bytes]] = []
        self._start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        end = time.monotonic() + 60
        self.address = ""
        while not self.address and time.monotonic() < end:
            # The file is there before it is written.
            with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):
                self.address = json.loads(self.file.read_text())["address"]
            time.sleep(0.05)

    def worker(self, **environment: str) -> None:
        """A new worker, with further variables of its environment."""
        one = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory")
        self._start("worker", *one, str(self.file.parent), **environment)

    def end(self, first: int = 0) -> None:
        """End the workers, from 1 on, or all of it."""
        for process in reversed(self.processes[first:]):
            process.kill()
            process.wait()
        del self.processes[first:]

    def _start(self, what: str, *given: str, **environment: str) -> None:
        command = [sys.executable, "-m", "dask", what, "--scheduler-file", str(self.file), *given]
        # Elsewhere than the checkout, which Python would find before all.
        how: Any = {"cwd": self.file.parent, "env": os.environ | environment}
        started = subprocess.Popen(command, stdout=self.log, stderr=self.log, **how)
        self.processes.append(started)


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dask]:
    found = Dask(tmp_path_factory.mktemp("dask"))
    yield found
    found.end()
    found.log.close()


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Run the map in tiles of a row; the place of its result."""
    monkeypatch.setattr(compute, "TILE", 12)

    def follow(name: str, hear: Callable[[str], None], scheduler: str | None) -> Path:
        loaded = loading.load(written(tmp_path, MAP, f"{name}.yaml"))
        planned = runner.plan(loaded, tmp_path)
        runner.follow(planned, 1, hear, scheduler)
        return planned.target

    return follow


@pytest.mark.slow
def test_a_worker_that_comes_late_and_lacks_this_package_is_named(
    dask: Dask, run: Callable[..., Path], tmp_path: Path
) -> None:
    """What else it may lack is told by the worker itself, see below."""
    lines: list[str] = []
    (tmp_path / "rigidpend.py").write_text("raise ImportError('libm.so: it is broken')")

    def hear(line: str) -> None:
        lines.append(line)
        if "no workers yet" in line:
            dask.worker(PYTHONPATH=str(tmp_path))

    with pytest.raises(WorkerError, match="no rigidpend like the one here on tcp:"):
        run("lacking", hear, dask.address)
    assert sum("no workers" in line for line in lines) == 1
    dask.end(1)


@pytest.mark.slow
def test_sweeps_proofs_and_orbits_come_from_a_cluster_as_from_here(
    dask: Dask, tmp_path: Path
) -> None:
    dask.worker()
    written(tmp_path, SMALL, "small.yaml")
    far = ("--scheduler", dask.address)
    given = ("small.yaml", "--set", "problem.arrays.only.count=2", "--out")
    for folder, more in (("here", ("-j", "1")), ("there", far)):
        swept = ("--sweep", "problem.mu=1e-3,2e-3", "-q", *more)
        assert call(tmp_path, "run", *given, folder, *swept).returncode == 0
        proof = ("certify", *given, folder, "--set", "problem.n_symbols=1", *more)
        assert call(tmp_path, *proof).returncode == 0
    for name in ("small_mu=1e-3.h5", "small_mu=2e-3.h5", "small.certificate.h5"):
        read = certificate_files.read if "certificate" in name else store.load
        one, other = (read(tmp_path / folder / name) for folder in ("here", "there"))
        np.testing.assert_equal(one["data"], other["data"])
        assert "workers" not in one["provenance"]
        # What a crowd of workers takes tells nothing of the time here.
        times = [runner.SECONDS in x["attributes"] for x in (one, other)]
        assert times == ([False, False] if "certificate" in name else [True, False])
        [(worker, count)] = json.loads(other["provenance"]["workers"]).items()
        assert count == (2 if "certificate" in name else 1)
        assert re.match(r"tcp://.*:\d+ on .+: taylor \(.*numpy", worker)
    codes = [x for code in ("0^12 1^11", "1^12 0^11") for x in ("--code", code)]
    here, there = (call(tmp_path, "find", *codes, *more) for more in (("-j", "1"), far))
    assert (here.returncode, here.stdout) == (0, there.stdout)


@pytest.mark.slow
def test_the_same_comes_of_it_with_workers_killed_and_late_and_without_the_scheduler(
    dask: Dask, run: Callable[..., Path], caplog: pytest.LogCaptureFixture
) -> None:
    """Workers are those of the test before; at the end there is neither one nor a scheduler.

    Of what is lost Dask itself says nothing: its lines are tracebacks.
    """
    lines: list[str] = []
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).addHandler(caplog.handler)

    def disturb(line: str) -> None:
        lines.append(line)
        if "cluster: 3 of 12" in line:
            # With a part in its hands; another one comes.
            dask.end(1)
            dask.worker()
        if "cluster: 6 of 12" in line:
            # With the worker, which might have all the other parts ready.
            dask.end()

    if len(dask.processes) < 2:
        dask.worker()
    with pytest.raises(WorkerError, match=r"went away; the same command computes what is missing"):
        run("lost", disturb, dask.address)
    assert not caplog.records
    # These parts may be of one plane of several: the experiment reports its share itself.
    told = [line for line in lines if isinstance(line, PartDone) and line.startswith("cluster: ")]
    assert {line.share for line in told} == {0.0}
    found = store.load(run("lost", lines.append, None))
    assert any(re.match(r"continues from \d+ finished parts", line) for line in lines)
    assert found["data"]["codes"].shape == (4, 12, 12)
    here = store.load(run("here", tell_nobody, None))
    np.testing.assert_equal(found["data"], here["data"])


def test_parts_are_given_on_with_those_before_them_and_none_of_an_earlier_run_comes_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else an experiment would report its share only when all parts of an array are there."""
    parts, come = Parts(tmp_path / "x.h5", "a"), list[str]()

    def made(name: str) -> Tree:
        return {"x": np.array(name.encode())}

    def gathered(*given: Any) -> Iterator[Any]:
        names = [piece.name for piece in given[3]]
        for name in (*names[1::-1], *names[2:]):
            come.append(name)
            yield made(name), name, "far"

    for name in "ab":
        parts.keep(name, partial(made, name))
    monkeypatch.setattr(cluster, "gathered", gathered)
    pieces = [Piece(name, partial(fail, MemoryError())) for name in "abcdefg"]
    given, found = ("tcp://nowhere:1", "route_map", "taylor", parts), list[tuple[str, int]]()
    # Arrays of one run, each of which is asked for by itself.
    for array in (pieces[1:5], pieces[:1], pieces[5:]):
        coming = cluster.computed(*given, array, report=tell_nobody)
        found += [(str(tree["x"]), len(come)) for tree in coming]
    counts = zip("bcdeafg", (0, 2, 2, 3, 3, 5, 5), strict=True)
    assert found == [(f"b'{name}'", count) for name, count in counts]
    assert parts.crew == {"an earlier run, by the same code and engine": 2, "far": 5}


@pytest.mark.slow
def test_a_scheduler_that_does_not_answer_is_named(
    run: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "PATIENCE", 0.3)
    with socket.socket() as listening:
        # Something is there that says nothing: nor does it end.
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        for port in (9, listening.getsockname()[1]):
            with pytest.raises(WorkerError, match=rf"no Dask scheduler answers at .*:{port} \("):
                run("nobody", tell_nobody, f"tcp://127.0.0.1:{port}")


class Held:
    """A client of a scheduler that keeps what it is given, and gives one thing back at a time."""

    def __init__(self, threads: list[int]) -> None:
        self.threads, self.kept, self.most = threads, list[Any](), 0

    def __call__(self, *_: Any, **__: Any) -> "Held":
        return self

    def __enter__(self) -> "Held":
        return self

    def __exit__(self, *_: object) -> None:
        """It goes."""

    def nthreads(self) -> dict[str, int]:
        return {"far": self.threads.pop(0) if self.threads else 2}

    def as_current(self) -> Any:
        return contextlib.nullcontext()

    def submit(self, work: Any, call: bytes, *, pure: bool) -> Any:
        assert work is pickle.loads
        assert not pure, "an equal call from before is computed again"
        done = Mock(result=Mock(return_value=({"x": len(call)}, "far")))
        self.kept.append(done)
        self.most = max(self.most, len(self.kept))
        return done

    def wait(self, futures: list[Any], _: float, until: str) -> Any:
        assert futures == self.kept
        assert until == "FIRST_COMPLETED"
        if self.threads:
            raise TimeoutError
        return SimpleNamespace(done={self.kept.pop(0)})


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> Held:
    """A client without workers at first, with one of two threads, without it, and with it again."""
    found = Held([0, 0, 0, 2, 0, 0, 2])
    monkeypatch.setattr("distributed.Client", found)
    monkeypatch.setattr("distributed.wait", found.wait)
    return found


PIECES = [Piece(name, dict) for name in "abcdefghij"]
GATHERED = "tcp://head:8786", "route_map", "taylor", PIECES


@pytest.mark.parametrize(("least", "each", "most"), [(4, 1, 4), (1, 3, 6)])
def test_some_parts_are_sent_ahead_and_each_comes_back_once(
    held: Held, monkeypatch: pytest.MonkeyPatch, least: int, each: int, most: int
) -> None:
    """Each time that there are no workers this is said once."""
    monkeypatch.setattr(cluster, "LEAST_AHEAD", least)
    monkeypatch.setattr(cluster, "AHEAD", each)
    lines: list[str] = []
    coming = cluster.gathered(*GATHERED, lines.append)
    # Nobody asks for more than there are.
    found = [name for _, name, _ in itertools.islice(coming, len(PIECES))]
    coming.close()
    assert (found, held.most) == (list("abcdefghij"), most)
    assert sum("no workers yet" in line for line in lines) == 2
    parts = [line for line in lines if isinstance(line, PartDone)]
    assert parts == [f"cluster: {k} of 10 parts" for k in range(1, 11)]
    assert lines[0] == "cluster tcp://head:8786: 10 parts, 0 threads"


@pytest.mark.parametrize("answers", [True, False])
def test_after_a_signal_neither_a_part_nor_the_scheduler_is_waited_for(
    held: Held, monkeypatch: pytest.MonkeyPatch, answers: bool
) -> None:
    over = threading.Event()
    if not answers:
        monkeypatch.setattr("distributed.Client", lambda *_, **__: over.wait())
    monkeypatch.setattr(cluster, "check_stop", Mock(side_effect=KeyboardInterrupt))
    try:
        with pytest.raises(KeyboardInterrupt):
            next(cluster.gathered(*GATHERED, tell_nobody))
        assert not held.kept
    finally:
        over.set()


def test_errors_of_the_cluster_are_sentences() -> None:
    import distributed

    gone = "went away; the same command computes what is missing"
    killed = distributed.KilledWorker("part", SimpleNamespace(address="tcp://far:1"), 3)
    for error, said in (
        (OSError("Timed out"), gone),
        (ConnectionResetError(), gone),
        (distributed.CancelledError("part"), gone),
        (killed, r"worker tcp://far:1 died .* lack of memory: give it more"),
    ):
        with pytest.raises(WorkerError, match=said), cluster.named_errors("tcp://head:8786"):
            raise error


def on_worker(work: Callable[..., Any], *given: Any, **other: str) -> Any:
    """What a worker gives that is asked by a machine with other things."""
    own, job = (
        cluster.facts_of("route_map", "taylor"),
        pickle.dumps(Piece("x", partial(work, *given))),
    )
    return cluster.on_worker("route_map", "taylor", {**own, **other}, job)


def fail(error: Exception) -> Any:
    """Work that a worker cannot do."""
    raise error


class Failing:
    """What a worker cannot unpickle: its module lacks something there."""

    def __reduce__(self) -> Any:
        return fail, (ModuleNotFoundError("No module named 'mpmath'", name="mpmath"),)


@pytest.mark.parametrize(
    ("given", "other", "said"),
    [
        *(
            ((), {what: "another"}, f" has another {what} .* install the same rigidpend and .* lib")
            for what in ("code", "engine")
        ),
        ((MemoryError(),), {}, " has not enough memory: give it more, .* --memory-limit"),
        ((ImportError("x"),), {}, r": tests cannot be loaded there \(x\): install it anew"),
        ((Failing(),), {}, ": mpmath cannot be loaded there .*: install it anew"),
    ],
)
def test_what_a_worker_lacks_or_has_otherwise_is_said_of_it(
    given: Any, other: dict[str, str], said: str
) -> None:
    with pytest.raises(WorkerError, match=rf"the worker on \S+{said}"):
        on_worker(fail if given else dict, *given, **other)
    assert on_worker(dict)[0] == {}


def test_threads_of_a_worker_import_schemas_one_after_the_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Python 3.11 ended parts with a SystemError, as pydantic reads the source of classes."""
    begun, beside = list[str](), list[str]()

    def schema(name: str) -> None:
        begun.append(name)
        time.sleep(0.01)
        beside.extend([name] * (begun[-1] != name))

    monkeypatch.setattr(experiments, "schema", schema)
    with ThreadPoolExecutor(2) as pool:
        assert [tree for tree, _ in pool.map(on_worker, [dict] * 2)] == [{}] * 2
    assert begun == [*experiments.names()] * 2
    assert not beside


@pytest.mark.parametrize(
    "address", ["", "head", "head:", ":8786", "head:x", "tcp://head", "http://head:8786", "a:1/b"]
)
def test_what_is_no_address_is_refused(address: str) -> None:
    said = f"{address!r} is not the address of a scheduler, such as tcp://host:8786"
    assert cluster.complaint(address) == said
    assert not cluster.complaint("head:8786") + cluster.complaint("tls://[::1]:8786")


def test_without_the_extra_the_command_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    done = call(tmp_path, "run", "route_map", "--scheduler", "tcp://nowhere:1")
    assert done.returncode == 3
    assert "python -m pip install 'rigidpend[cluster]'" in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_worker_needs_the_code_of_the_experiment_and_that_which_proves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = cluster.facts_of("route_map", "taylor")
    assert cluster.facts_of("exponents", "taylor")["code"] != before["code"]
    assert cluster.facts_of("route_map", "scipy")["engine"] != before["engine"]
    monkeypatch.setattr(cluster, "code_hash_of", lambda *files: f"another {len(files)}")
    assert cluster.facts_of("route_map", "taylor")["code"] != before["code"]
