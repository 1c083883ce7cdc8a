"""Parts of a run computed by a Dask cluster, whichever of its workers come and go.

The scheduler gives a part that was on a lost worker to another one. Here each part is kept on
disk as soon as it is there, as if it had been computed here: the result is the same file, and a
run that was interrupted goes on, with the cluster or without.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rigidpend.results.tree import Tree
from rigidpend.run import provenance
from rigidpend.run.parts import Parts, Piece
from rigidpend.run.workers import WorkerError

AHEAD = 3
"""Parts in the scheduler's hands for each thread of the workers, so that none of them waits."""
LEAST_AHEAD = 16
"""The same at least, for workers that are still to come."""
PATIENCE = "15s"
"""Time for the scheduler to answer."""


class ClusterExtraMissing(ModuleNotFoundError):
    """Error: distributed is not installed; tells how to install it."""


def check_extra() -> None:
    """Make sure that Dask's scheduler can be talked to.

    Raises
    ------
    ClusterExtraMissing
        The extra `cluster` is not installed.
    """
    if importlib.util.find_spec("distributed") is None:
        raise ClusterExtraMissing(
            "distributed is needed for --scheduler, and not installed;"
            " install it with: python -m pip install 'rigidpend[cluster]'",
            name="distributed",
        )


def computed(
    address: str,
    experiment: str,
    parts: Parts,
    pieces: Sequence[Piece],
    report: Callable[[str], None],
) -> Iterator[Tree]:
    """Let a cluster compute what is not kept yet, then give all parts in their order.

    Parameters
    ----------
    address : str
        Of the scheduler, as in ``tcp://host:8786``.
    experiment : str
    parts : Parts
        Keeps each part as soon as it is there.
    pieces : sequence of Piece
        Their functions and arguments go to other machines, pickled.
    report : callable
        Takes lines of progress.

    Raises
    ------
    WorkerError
        The scheduler does not answer, or a worker has another version of this package.
    """
    missing = [piece for piece in pieces if not parts.has(piece.name)]
    if missing:
        _gather(address, experiment, parts, missing, report)
    # One at a time from the disk: memory holds none of them together.
    return parts.in_order(pieces)


def _gather(
    address: str,
    experiment: str,
    parts: Parts,
    missing: Sequence[Piece],
    report: Callable[[str], None],
) -> None:
    """Compute parts on the cluster, a few ahead of what its workers have in hand."""
    import distributed

    code, waiting, done = provenance.code_hash(experiment), iter(missing), 0
    with _client(address) as client, _named_errors(address):
        threads = sum(client.nthreads().values())
        report(f"cluster {address}: {len(missing)} parts, {threads} threads")
        names: dict[Any, str] = {}
        flow = distributed.as_completed([], loop=client.loop, with_results=True)

        def supply() -> None:
            room = max(LEAST_AHEAD, AHEAD * sum(client.nthreads().values()))
            while len(names) < room and (piece := next(waiting, None)) is not None:
                given = (experiment, code, piece.work, piece.arguments)
                future = client.submit(_on_worker, *given, pure=False)
                names[future] = piece.name
                flow.add(future)

        supply()
        for future, tree in flow:
            parts.keep(names.pop(future), lambda: tree)  # noqa: B023
            done += 1
            report(f"cluster: {done} of {len(missing)} parts")
            supply()


def _client(address: str) -> Any:
    """A client of the scheduler."""
    import distributed

    try:
        return distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise WorkerError(f"no Dask scheduler answers at {address}: {error}") from None


@contextmanager
def _named_errors(address: str) -> Iterator[None]:
    """Errors of the cluster as sentences of ours."""
    from distributed import CancelledError, KilledWorker
    from distributed.comm import CommClosedError

    continues = "what is finished is kept: the same command again continues"
    try:
        yield
    except KilledWorker:
        said = "a part was lost with its worker again and again, perhaps for want of memory"
        raise WorkerError(f"cluster {address}: {said}; {continues}") from None
    except (CancelledError, CommClosedError, OSError):
        # A connection that closes, or one that is not made again in time.
        raise WorkerError(f"cluster {address}: the scheduler went away; {continues}") from None


def _on_worker(experiment: str, code: str, work: Callable[..., Tree], arguments: Any) -> Tree:
    """Compute a part on a worker that has the same code."""
    own = provenance.code_hash(experiment)
    if own != code:
        import socket

        raise WorkerError(
            f"the worker on {socket.gethostname()} has other code ({own}) than this machine"
            f" ({code}): install the same rigidpend there"
        )
    return work(*arguments)
