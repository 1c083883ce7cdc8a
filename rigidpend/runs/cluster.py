"""Parts of a run computed by a Dask cluster, whichever of its workers come and go.

The scheduler gives a part that was on a lost worker to another one. Here each part is kept on
disk as soon as it is there, as if it had been computed here: the result is the same file, and a
run that was interrupted goes on, with the cluster or without.
"""

from __future__ import annotations

import importlib.util
import itertools
import pickle
import platform
import socket
import threading
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import Future, wait
from contextlib import contextmanager
from typing import Any, NamedTuple
from urllib.parse import urlsplit

from rigidpend.experiments.contract import Piece
from rigidpend.experiments.data import Tree
from rigidpend.machine import wording
from rigidpend.machine.code_hash import code_hash_of, digest, inside
from rigidpend.machine.files import Absent
from rigidpend.machine.progress import PartDone
from rigidpend.machine.workers import PERIOD, WorkerError, check_stop
from rigidpend.runs import provenance
from rigidpend.runs.parts import Parts

AHEAD = 3
"""Parts in the scheduler's hands for each thread of the workers, so that none of them waits."""
LEAST_AHEAD = 16
"""The same at least, for workers that are still to come."""
PATIENCE = 5.0
"""Seconds for the scheduler to answer."""
SCHEMES = ("", "tcp", "tls", "ws", "wss")
"""Ways to reach a scheduler; tcp where nothing is said."""
LOOK = 0.5
"""Seconds between two looks at the workers."""
ROOM = "give it more, or fewer threads, for example by dask worker --nthreads 1 --memory-limit 8GB"
"""The cure for lack of memory."""
PROVING_AND_FINDING = (("certified", "codes.py"), ("symbolic", "find.py"))
"""Modules of routes that workers compute with besides an experiment's own."""
CONTINUES = "finished parts are kept, and the same command continues"


def check_extra() -> None:
    """Make sure that Dask's scheduler can be talked to: that the extra `cluster` is installed."""
    if importlib.util.find_spec("distributed") is None:
        raise Absent(
            "distributed is needed for --scheduler, and not installed;"
            " install it with: python -m pip install 'rigidpend[cluster]'"
        )


def complaint(address: str) -> str:
    """Reason why no scheduler can have this address; empty if one can."""
    scheme, _, place = address.rpartition("://")
    try:
        parts = urlsplit(f"//{place}")
        usable = scheme in SCHEMES and parts.hostname and parts.port and parts.netloc == place
    except ValueError:
        usable = None
    return (
        "" if usable else f"{address!r} is not the address of a scheduler, such as tcp://host:8786"
    )


def computed(
    address: str,
    experiment: str,
    engine: str,
    parts: Parts,
    pieces: Sequence[Piece],
    report: Callable[[str], None],
    crew: dict[str, int],
) -> Iterator[Tree]:
    """Let a cluster compute what is not kept yet, then give all parts in their order.

    Functions and arguments of pieces go to other machines, pickled; each part is kept as soon as it
    is there, and `crew` takes up how many each worker computes. The engine is empty for closed
    forms. WorkerError where the scheduler does not answer, or a worker cannot do what this machine
    does: it has another version, lacks a library or memory, or dies again and again.
    """
    missing = [piece for piece in pieces if not parts.has(piece.name)]
    if len(missing) < len(pieces):
        crew["an earlier run, by the same code and engine"] = len(pieces) - len(missing)
    if missing:
        for tree, name, worker in gathered(address, experiment, engine, missing, report):
            parts.keep(name, lambda: tree)  # noqa: B023
            crew[worker] = crew.get(worker, 0) + 1
    # One at a time from the disk: memory holds none of them together.
    return parts.in_order(pieces)


def gathered(
    address: str,
    experiment: str,
    engine: str,
    pieces: Sequence[Piece],
    report: Callable[[str], None],
) -> Iterator[tuple[Any, str, str]]:
    """Outcomes of pieces on a cluster's workers, with the names of piece and worker, as they come.

    Some pieces are sent ahead of those that are in hand. Takes and raises what :func:`computed`
    does; nothing is kept.
    """
    given = experiment, engine, facts_of(experiment, engine)
    waiting, names, done, idle = iter(pieces), dict[Any, str](), 0, False
    with _client(address) as client, named_errors(address):
        report(f"cluster {address}: {len(pieces)} parts, {sum(client.nthreads().values())} threads")
        while done < len(pieces):
            check_stop()
            threads = sum(client.nthreads().values())
            if not threads and not idle:
                wanted = f"no workers yet; it waits for one, started by: dask worker {address}"
                report(f"cluster {address}: {wanted}")
            idle = not threads
            ahead = max(LEAST_AHEAD, AHEAD * threads) - len(names)
            for piece in itertools.islice(waiting, max(0, ahead)):
                call = pickle.dumps(_Call((*given, pickle.dumps((piece.work, piece.arguments)))))
                names[client.submit(pickle.loads, call, pure=False)] = piece.name
            for future in _ready(client, list(names)):
                done += 1
                tree, worker = _answer(client, future)
                yield tree, names.pop(future), worker
                report(PartDone(f"cluster: {done} of {len(pieces)} parts", done, len(pieces)))


class _Call(NamedTuple):
    """A part that is computed where it is unpickled.

    Plain bytes reach a worker that lacks this package, too: it then fails in words, where our
    functions as such would end the worker.
    """

    arguments: tuple[Any, ...]

    def __reduce__(self) -> Any:
        return on_worker, self.arguments


def _ready(client: Any, futures: list[Any]) -> Collection[Any]:
    """Those of some futures that are done, once one of them is; none if that takes long."""
    import distributed

    try:
        with client.as_current():
            return distributed.wait(futures, LOOK, "FIRST_COMPLETED").done
    except TimeoutError:
        return ()


def _answer(client: Any, future: Any) -> tuple[Tree, str]:
    """Outcome of a part on a worker, with the worker's name."""
    try:
        return future.result()
    except (ImportError, AttributeError) as error:
        tried = client.run(exec, f"import {__name__}", on_error="return")
        lacking = [worker for worker, failed in tried.items() if failed is not None]
        raise WorkerError(
            f"no rigidpend like the one here on {', '.join(lacking) or 'a lost worker'} ({error}):"
            f" install it there; {CONTINUES}"
        ) from None


def _client(address: str) -> Any:
    """A client of the scheduler; what listens there and says nothing is none."""
    import distributed

    made: Future[Any] = Future()

    def connect() -> None:
        try:
            made.set_result(distributed.Client(address, timeout=PATIENCE, set_as_default=False))
        except Exception as error:  # noqa: BLE001
            made.set_exception(error)

    threading.Thread(target=connect, daemon=True).start()
    until = time.monotonic() + PATIENCE
    while wait([made], PERIOD).not_done and time.monotonic() < until + 1:
        check_stop()
    try:
        return made.result(0)
    except Exception as error:  # noqa: BLE001
        said = str(error) or f"silent for {PATIENCE:g} s"
        raise WorkerError(
            f"no Dask scheduler answers at {address} ({said}); start one there: dask scheduler"
        ) from None


@contextmanager
def named_errors(address: str) -> Iterator[None]:
    """Errors of the cluster as sentences of ours."""
    from distributed import CancelledError, KilledWorker
    from distributed.comm import CommClosedError

    try:
        yield
    except KilledWorker as error:
        lost = getattr(error.last_worker, "address", "of unknown address")
        said = f"worker {lost} died with a part, as others did before, perhaps for lack of memory"
        raise WorkerError(f"cluster {address}: {said}: {ROOM}; {CONTINUES}") from None
    except (CancelledError, CommClosedError, OSError):
        # A connection that closes, or one that is not made again in time.
        raise WorkerError(f"cluster {address}: the scheduler went away; {CONTINUES}") from None


def facts_of(experiment: str, engine: str) -> dict[str, str]:
    """All that decides the numbers of a part on this machine: of results, proofs and addresses."""
    routes = (inside("routes", *place) for place in PROVING_AND_FINDING)
    code = digest(provenance.code_hash(experiment) + code_hash_of(*routes))
    return {"code": code, "engine": provenance.engine_name(engine)}


def on_worker(experiment: str, engine: str, wanted: dict[str, str], job: bytes) -> tuple[Tree, str]:
    """Compute a part on a worker that has the same code and engine; the worker's name with it.

    The job is unpickled here, where it is known what the worker is called that cannot do it.
    """
    here, own = _name(), facts_of(experiment, engine)
    for what, value in wanted.items():
        if own[what] != value:
            raise WorkerError(
                f"the worker {here} has another {what} ({own[what]}) than this machine ({value}):"
                " install the same rigidpend and the same libraries there"
            )
    try:
        work, arguments = pickle.loads(job)
        tree = work(*arguments)
    except MemoryError:
        said = f"the worker {here} has not enough memory: {ROOM}; {CONTINUES}"
        raise WorkerError(said) from None
    except ImportError as error:
        said = f"the worker {here}: {wording.library(error) or 'a library'} cannot be loaded there"
        raise WorkerError(f"{said} ({wording.short(error)}): install it anew") from None
    libraries = ", ".join(f"{name} {provenance.version(name)}" for name in ("numpy", "mpmath"))
    return tree, f"{here}: {own['engine']}, {libraries}, Python {platform.python_version()}"


def _name() -> str:
    """This worker, by its address and its machine."""
    from distributed import get_worker

    try:
        return f"{get_worker().address} on {socket.gethostname()}"
    except ValueError:
        return f"on {socket.gethostname()}"
