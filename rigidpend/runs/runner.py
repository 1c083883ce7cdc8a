"""Runner: from configs to result files; a result that is up to date is not computed again."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidpend import experiments
from rigidpend.machine import files, wording
from rigidpend.machine.files import StoreError, twin
from rigidpend.machine.workers import check_stop, listening
from rigidpend.runs import provenance
from rigidpend.runs.parts import Parts, remove_leftovers

if TYPE_CHECKING:
    from rigidpend.experiments.contract import Piece
    from rigidpend.experiments.data import Layout, Tree
    from rigidpend.runs.loading import LoadedConfig

SECONDS = "seconds"
"""Root attribute for the time that a result took here, absent if the run continued from parts."""
DOUBT = "doubt"
"""Root attribute for the count of uncertain symbols."""


@dataclass(frozen=True)
class Plan:
    """Plan of a run: the place of its result, its fingerprint, and the reason to compute it."""

    config: LoadedConfig
    target: Path
    fingerprint: dict[str, str]
    """Hashes of config and code, and the engine: everything on which the result depends."""
    reason: str
    """Reason to compute the result; empty if the file is up to date."""
    doubt: str
    """Count of uncertain symbols in the existing result, in words."""
    seconds: float = 0.0
    """Seconds that the existing result took, if it is of the same config; else 0."""


REASONS = {
    "config_hash": "its config changed",
    "code_hash": "the code that computes it changed",
    "engine": "the engine changed",
}


def plan(config: LoadedConfig, folder: Path, *, force: bool = False) -> Plan:
    """Decide whether to run a config, always with `force`, and remove what a killed run left.

    StoreError if the file in the result's place is not a result of this package, or is damaged.
    """
    check_stop()
    target = folder / f"{config.name}.h5"
    if other := twin(target):
        message = f"{other} exists, and some systems ignore the difference in case"
        raise StoreError(f"{target}: {message}; choose another with --name")
    fingerprint = {
        "config_hash": config.config_hash,
        "code_hash": provenance.code_hash(config.content.experiment),
        "engine": provenance.engine_name(config.arithmetic.engine),
    }
    known: Mapping[str, Any] = {}
    if force:
        reason = "--force"
    elif not target.exists():
        reason = "no result yet"
    else:
        known, reason = _compared(target, fingerprint, config)
    if not reason:
        remove_leftovers(target)
    same = known.get("config_hash") == fingerprint["config_hash"]
    seconds = float(known.get(SECONDS, 0.0)) if same else 0.0
    return Plan(config, target, fingerprint, reason, str(known.get(DOUBT, "")), seconds)


def _compared(
    target: Path, fingerprint: dict[str, str], config: LoadedConfig
) -> tuple[Mapping[str, Any], str]:
    """Root attributes of the existing result, and the reason to compute it again, if any."""
    from rigidpend.config import writer
    from rigidpend.results import store

    files.make_way(target)
    try:
        known = store.attributes(target)
    except store.OtherVersion:
        return {}, "its result has another format version"
    except StoreError as error:
        raise StoreError(f"{error}; move it away, or overwrite it with --force") from None
    reasons = {key: said for key, said in REASONS.items() if known.get(key) != fingerprint[key]}
    # A program that changes values or attributes cuts off the digest.
    if files.unsealed(files.content(target)) is None:
        reasons["digest"] = "another program changed its file"
    if "config_hash" in reasons and "config_hash" in known:
        # If the stored config cannot be read, the changed keys cannot be named.
        with contextlib.suppress(StoreError):
            changed = writer.changes(store.load(target)["config"], config.resolved())
            reasons["config_hash"] += f"{': ' if changed else ''}{writer.sentence(changed)}"
    return known, "; ".join(reasons.values())


def expected_seconds(planned: Plan) -> float:
    """Estimate of the seconds that a plan takes to compute; 0 without any estimate.

    It is the time that an existing result of the same config took, on any machine, or else the
    experiment's own estimate.
    """
    return planned.seconds or experiments.cost(planned.config.content)


def follow(
    planned: Plan, jobs: int, say: Callable[[str], None], scheduler: str | None = None
) -> None:
    """Run a planned experiment and report its reason, its progress and its end.

    Arguments and errors are those of :func:`run`. Finished parts are stored.
    """
    start = time.perf_counter()
    say(f"computing ({planned.reason}), {planned.fingerprint['engine']}")
    told = run(planned, jobs=jobs, report=say, scheduler=scheduler)
    doubt = f"; {told}" if told else ""
    say(f"{planned.target} written, {time.perf_counter() - start:.2f} s{doubt}")


def run(
    planned: Plan,
    *,
    jobs: int,
    report: Callable[[str], None],
    further: Mapping[str, Any] | None = None,
    scheduler: str | None = None,
) -> str:
    """Compute a planned experiment, write its result file, and return the count of uncertainties.

    Results do not depend on `jobs`, the number of threads or processes. `report` receives lines of
    progress, `further` has additional root attributes, and the Dask cluster at the address
    `scheduler` computes the experiment's pieces. Parts that an earlier run of the same fingerprint
    finished are not computed again. StoreError, WorkerError or ArithmeticError if the result cannot
    be computed or written: finished parts stay stored.
    """
    from rigidpend.experiments.contract import Means, Piece
    from rigidpend.results import store

    config, content = planned.config, planned.config.content
    files.prepare(planned.target)
    parts = Parts(planned.target, json.dumps(planned.fingerprint))
    with ThreadPoolExecutor(1) as aside, listening(report) as tell:
        # Git is asked in a thread while the experiment is computed.
        told = aside.submit(provenance.provenance)
        start, resumed = time.perf_counter(), len(parts)
        if resumed:
            tell(f"continues from {wording.counted(len(parts), 'finished part')}")
        check_stop()
        arithmetic, asked = config.arithmetic, {*content.numerics_asked} - {"engine"}
        chosen = {key: x for key, x in arithmetic._asdict().items() if key in asked}
        pieces: Callable[[Sequence[Piece]], Iterator[Tree]] = partial(parts.in_order, jobs=jobs)
        if scheduler is not None:
            from rigidpend.runs import cluster

            cluster_of = scheduler, content.experiment, arithmetic.engine, parts
            pieces = partial(cluster.computed, *cluster_of, report=tell)
        # On a cluster each thread of a worker has a piece of its own, and a piece has one job.
        away, computation = scheduler is not None, experiments.computation(content.experiment)
        if away and not getattr(computation, "PIECES", False):
            whole = Piece("whole", partial(computation.compute, content, Means(arithmetic)))
            [data] = pieces([whole])
        else:
            means = Means(arithmetic, 1 if away else jobs, tell, pieces, parts.has)
            data = computation.compute(content, means)
        layout = experiments.layout(content.experiment)
        # Data that come in blocks are computed now.
        with store.image(layout, data) as file:
            attributes: dict[str, Any] = {
                "name": config.name,
                "figure": content.figure,
                "experiment": content.experiment,
                **planned.fingerprint,
                **chosen,
                DOUBT: doubt(layout, data),
                **({} if resumed or away else {SECONDS: time.perf_counter() - start}),
                **(further or {}),
            }
            # A signal may have ended Git or a worker, and so have spoilt the provenance or data.
            check_stop()
            made = told.result() | provenance.of_workers(parts.crew)
            store.finish(file, planned.target, attributes, config.resolved(), made)
        # Parts are dropped last: a failure before this line leaves them for the next run.
        parts.drop()
        return str(attributes[DOUBT])


def doubt(layout: Layout, data: Tree) -> str:
    """Count of the uncertain symbols of a result, in words; empty if there are none.

    They are counted in every array of flags named `certain`.
    """
    import numpy as np

    from rigidpend.experiments.data import FLAG, fields

    named = ((place.rpartition("/")[2], x, field) for place, x, field in fields(layout, data))
    flags = [x for name, x, field in named if (name, field.kind) == ("certain", FLAG)]
    uncertain = sum(int(np.count_nonzero(~x)) for x in flags)
    return f"{uncertain} of {sum(map(np.size, flags))} symbols uncertain" if uncertain else ""
