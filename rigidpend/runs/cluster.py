"""Parts of a run computed by a Dask cluster, whose workers may join and leave.

The scheduler gives the part of a lost worker to another one. This process stores each part on disk
as soon as it arrives, as if it had computed the part itself: the result is the same file, and an
interrupted run continues, with the cluster or without.
"""

import importlib.util
import itertools
import logging
import pickle
import platform
import socket
import threading
import time
from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from concurrent.futures import Future, wait
from contextlib import closing, contextmanager
from typing import Any, NamedTuple
from urllib.parse import urlsplit

from rigidpend import experiments
from rigidpend.experiments.contract import Piece
from rigidpend.experiments.data import Tree
from rigidpend.machine import wording
from rigidpend.machine.code_hash import code_hash_of, digest, inside
from rigidpend.machine.files import Absent
from rigidpend.machine.progress import PartDone
from rigidpend.machine.workers import CHECK_PERIOD, WorkerError, check_stop
from rigidpend.runs import provenance
from rigidpend.runs.parts import Parts

AHEAD = 3
"""Parts given to the scheduler for each thread of the workers, so that no thread waits."""
LEAST_AHEAD = 16
"""Least number of parts given to the scheduler, for workers that join later."""
PATIENCE = 5.0
"""Seconds for the scheduler to answer."""
SCHEMES = ("", "tcp", "tls", "ws", "wss")
"""Protocols to reach a scheduler; tcp if none is given."""
LOOK = 0.5
"""Seconds between two looks at the workers."""
ROOM = "give it more, or fewer threads, for example by dask worker --nthreads 1 --memory-limit 8GB"
"""Advice for a worker that runs out of memory."""
PROVING_AND_FINDING = (("certified", "codes.py"), ("symbolic", "find.py"))
"""Modules of routes that workers use besides those of an experiment."""
CONTINUES = "the same command computes what is missing"
_importing = threading.Lock()


def check_extra() -> None:
    """Raise Absent unless the extra `cluster` is installed, which has the client of Dask."""
    if importlib.util.find_spec("distributed") is None:
        raise Absent(
            "distributed is needed for --scheduler, and not installed;"
            " install it with: python -m pip install 'rigidpend[cluster]'"
        )


def complaint(address: str) -> str:
    """Reason why no scheduler can have this address; empty if it is possible."""
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
) -> Iterator[Tree]:
    """Let a cluster compute the parts that are not stored yet; yield all in order, as they come.

    Functions and arguments of pieces go to other machines, pickled; each part is stored as soon as
    it arrives, and counted for its worker. The engine is empty for closed forms.
    WorkerError if the scheduler does not answer, or if a worker has another version, lacks a
    library or memory, or dies repeatedly.
    """
    missing = {piece.name: piece for piece in pieces if not parts.has(piece.name)}
    if len(missing) < len(pieces):
        # Added, because an experiment with several arrays comes here for each of them.
        parts.crew["an earlier run, by the same code and engine"] += len(pieces) - len(missing)
    with closing(gathered(address, experiment, engine, [*missing.values()], report)) as coming:
        for piece in pieces:
            while piece.name in missing:
                tree, name, worker = next(coming)
                parts.keep(name, lambda: tree)  # noqa: B023
                parts.crew[worker] += 1
                del missing[name]
            # Read from disk one at a time: memory never holds all of them.
            yield from parts.in_order([piece])


def gathered(
    address: str,
    experiment: str,
    engine: str,
    pieces: Sequence[Piece],
    report: Callable[[str], None],
) -> Generator[tuple[Any, str, str], None, None]:
    """Outcomes of pieces on a cluster's workers, with names of piece and worker, as they arrive.

    Some pieces are sent ahead of those being computed. Arguments and errors are those of
    :func:`computed`; nothing is stored.
    """
    given = experiment, engine, facts_of(experiment, engine)
    waiting, names, done, idle = iter(pieces), dict[Any, str](), 0, False
    with _client(address) as client, named_errors(address):
        threads = sum(client.nthreads().values())
        every = wording.counted(len(pieces), "part")
        report(f"cluster {address}: {every}, {wording.counted(threads, 'thread')}")
        while done < len(pieces):
            check_stop()
            threads = sum(client.nthreads().values())
            if not threads and not idle:
                wanted = f"no workers yet; it waits for one, started by: dask worker {address}"
                report(f"cluster {address}: {wanted}")
            idle = not threads
            ahead = max(LEAST_AHEAD, AHEAD * threads) - len(names)
            for piece in itertools.islice(waiting, max(0, ahead)):
                call = pickle.dumps(_Call((*given, pickle.dumps(piece))))
                # Not pure, so that Dask never takes a result of an equal call from before.
                names[client.submit(pickle.loads, call, pure=False)] = piece.name
            for future in _ready(client, list(names)):
                done += 1
                tree, worker = _answer(client, future)
                # They may be a part of the experiment, which reports its share itself.
                report(PartDone(f"cluster: {done} of {every}"))
                yield tree, names.pop(future), worker


class _Call(NamedTuple):
    """A part that is computed where it is unpickled.

    A worker without this package can receive plain bytes, and then fails with a message; an
    unknown function of ours would end the worker.
    """

    arguments: tuple[Any, ...]

    def __reduce__(self) -> Any:
        return on_worker, self.arguments


def _ready(client: Any, futures: list[Any]) -> Collection[Any]:
    """Wait until some of the futures are done and return these; none after a while."""
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
        # The function could not be unpickled: each worker is asked if it can import this module.
        tried = client.run(exec, f"import {__name__}", on_error="return")
        lacking = [worker for worker, failed in tried.items() if failed is not None]
        raise WorkerError(
            f"no rigidpend like the one here on {', '.join(lacking) or 'a lost worker'} ({error}):"
            f" install it there; {CONTINUES}"
        ) from None


def _client(address: str) -> Any:
    """A client of the scheduler; a server that does not answer counts as no scheduler."""
    import distributed

    # What is lost is told in our sentences: the library's own lines are tracebacks.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    made: Future[Any] = Future()

    def connect() -> None:
        try:
            made.set_result(distributed.Client(address, timeout=PATIENCE, set_as_default=False))
        except Exception as error:  # noqa: BLE001
            made.set_exception(error)

    # A thread of its own connects, because that may hang, and Ctrl-C must be obeyed meanwhile.
    threading.Thread(target=connect, daemon=True).start()
    until = time.monotonic() + PATIENCE
    while wait([made], CHECK_PERIOD).not_done and time.monotonic() < until + 1:
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
    """Turn errors of the cluster into sentences of WorkerError."""
    from distributed import CancelledError, KilledWorker

    try:
        yield
    except KilledWorker as error:
        lost = getattr(error.last_worker, "address", "of unknown address")
        said = f"worker {lost} died with a part, as others did before, perhaps for lack of memory"
        raise WorkerError(f"cluster {address}: {said}: {ROOM}; {CONTINUES}") from None
    except (CancelledError, OSError):
        # The connection closed, or was not made again in time.
        raise WorkerError(f"cluster {address}: the scheduler went away; {CONTINUES}") from None


def facts_of(experiment: str, engine: str) -> dict[str, str]:
    """Code hashes and versions that decide the numbers of a part, for comparison with a worker."""
    routes = (inside("routes", *place) for place in PROVING_AND_FINDING)
    code = digest(provenance.code_hash(experiment) + code_hash_of(*routes))
    return {"code": code, "engine": provenance.engine_name(engine)}


def on_worker(experiment: str, engine: str, wanted: dict[str, str], job: bytes) -> tuple[Tree, str]:
    """Compute a part on a worker with the same code and engine; return it with the worker's name.

    The job is unpickled here, so that an error can name the worker.
    """
    here = _name()
    try:
        # Classes of configs read their source when they are made, and Python 3.11 fails where two
        # threads do so: the first part that comes imports all of them.
        with _importing:
            list(map(experiments.schema, experiments.names()))
        own = facts_of(experiment, engine)
        for what, value in wanted.items():
            if own[what] != value:
                raise WorkerError(
                    f"the worker {here} has another {what} ({own[what]}) than this machine"
                    f" ({value}): install the same rigidpend and the same libraries there, and"
                    " start it anew"
                )
        tree = pickle.loads(job).compute()
    except MemoryError:
        said = f"the worker {here} has not enough memory: {ROOM}; {CONTINUES}"
        raise WorkerError(said) from None
    except ImportError as error:
        said = f"the worker {here}: {wording.library(error) or 'a library'} cannot be loaded there"
        raise WorkerError(f"{said} ({wording.short(error)}): install it anew") from None
    libraries = ", ".join(f"{name} {provenance.version(name)}" for name in ("numpy", "mpmath"))
    return tree, f"{here}: {own['engine']}, {libraries}, Python {platform.python_version()}"


def _name() -> str:
    """Name of this worker: its address and its machine."""
    from distributed import get_worker

    try:
        return f"{get_worker().address} on {socket.gethostname()}"
    except ValueError:
        return f"on {socket.gethostname()}"
