"""Runner: from configs to result files; what is up to date is left alone."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidpend import experiments
from rigidpend.machine.files import StoreError, twin
from rigidpend.machine.workers import check_stop, listening
from rigidpend.runs import provenance, recalled
from rigidpend.runs.parts import Parts, sweep
from rigidpend.runs.recalled import DOUBT, OTHER, SECONDS, AnyConfig

# What a plan that finds nothing to do does without is imported where it is used.
if TYPE_CHECKING:
    from rigidpend.config.schema import ExperimentConfig
    from rigidpend.experiments.contract import Piece
    from rigidpend.experiments.data import Tree
    from rigidpend.orbits.integrate.arithmetic import Arithmetic


@dataclass(frozen=True)
class Plan:
    """Plan of a run: a config, the file of its result, and the reason to compute it, if any."""

    config: AnyConfig
    target: Path
    fingerprint: dict[str, str]
    """Hashes of config and code, and the engine: all on which the result depends."""
    reason: str
    """Reason to compute the result; empty where the file is up to date."""
    doubt: str = ""
    """Count of what is uncertain in the result that is there, in words."""
    seconds: float = 0.0
    """Seconds that the result there took, if it is of the same config; else 0."""


REASONS = {
    "config_hash": "its config changed",
    "code_hash": "the code that computes it changed",
    "engine": "the engine changed",
}


def plan(config: AnyConfig, folder: Path, *, force: bool = False) -> Plan:
    """Decide whether a config is to be run; tidy up what a killed run left beside its result.

    Parameters
    ----------
    config : LoadedConfig or RecalledConfig
    folder : Path
        Where results are kept.
    force : bool, optional
        Compute even what is up to date.
    """
    check_stop()
    target = folder / f"{config.name}.h5"
    if other := twin(target):
        message = f"{other} is there, and some systems take both names for one file"
        raise StoreError(f"{target}: {message}; choose another with --name")
    fingerprint = {
        "config_hash": config.config_hash,
        "code_hash": provenance.code_hash(config.experiment),
        "engine": provenance.engine_name(config.engine),
    }
    known = {} if force else recalled.facts(target)
    reason = "--force" if force else _reason(known, fingerprint)
    if known.get("config_hash", fingerprint["config_hash"]) != fingerprint["config_hash"]:
        reason = reason.replace(REASONS["config_hash"], _changed(target, config))
    if not reason:
        sweep(target)
    same = known.get("config_hash") == fingerprint["config_hash"]
    seconds = float(known.get(SECONDS, 0.0)) if same else 0.0
    return Plan(config, target, fingerprint, reason, str(known.get(DOUBT, "")), seconds)


def expected_seconds(planned: Plan) -> float | None:
    """Estimate how long a plan takes to compute, in seconds; None where nothing tells.

    A result of the same problem says what it took, on whatever machine; else the experiment does.
    """
    if planned.seconds:
        return planned.seconds
    if not planned.reason:
        return None
    return experiments.cost(planned.config.experiment, planned.config.content)


def follow(
    planned: Plan, *, jobs: int, say: Callable[[str], None], scheduler: str | None = None
) -> None:
    """Run a planned experiment and report its progress.

    Parameters
    ----------
    planned : Plan
    jobs : int
        Threads or processes; no result depends on it.
    scheduler : str, optional
        Address of a Dask cluster that computes the experiment's pieces.
    say : callable
        Takes lines of progress: the beginning with its reason, the parts, the end.

    Raises
    ------
    StoreError, WorkerError, ArithmeticError
        It cannot be computed or written. Finished parts are kept.
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
    """Compute a planned experiment and write its result file.

    What an earlier run of the same fingerprint finished is not computed again.

    Parameters
    ----------
    planned : Plan
    jobs : int
    report : callable
        Takes a line of progress.
    further : dict, optional
        Root attributes besides.
    scheduler : str, optional
        Address of a Dask cluster that computes the experiment's pieces.

    Returns
    -------
    str
        How many symbols are uncertain; empty where none is.

    Raises
    ------
    StoreError
        The file cannot be written.
    """
    from rigidpend.experiments.contract import Means, Piece
    from rigidpend.results import store

    config, content = planned.config, planned.config.content
    store.prepare(planned.target)
    fingerprint = json.dumps(planned.fingerprint)
    with (
        Parts(planned.target, fingerprint) as parts,
        ThreadPoolExecutor(1) as aside,
        listening(report) as tell,
    ):
        # Git is asked while the experiment is computed.
        told = aside.submit(provenance.provenance)
        start, resumed = time.perf_counter(), len(parts)
        if resumed:
            tell(f"goes on from {len(parts)} finished part{'s' if len(parts) > 1 else ''}")
        check_stop()
        arithmetic = _arithmetic(planned)
        crew: dict[str, int] = {}
        # Each thread of a cluster's workers has a piece of its own.
        away, given = scheduler is not None, (config.experiment, content, arithmetic)
        pieces = _pieces(parts, planned, scheduler, tell, crew, jobs)
        means = Means(arithmetic, 1 if away else jobs, tell, parts.keep, pieces, away)
        if away and not experiments.in_pieces(config.experiment):
            [data] = pieces([Piece("whole", _whole, given)])
        else:
            data = experiments.computation(config.experiment).compute(content, means)
        # What comes in blocks is computed now.
        with store.Image(data) as image:
            attributes: dict[str, Any] = {
                "name": config.name,
                "figure": content.figure,
                "experiment": config.experiment,
                **planned.fingerprint,
                **_stored(arithmetic, config),
                DOUBT: doubt(data),
                **({} if resumed else {SECONDS: time.perf_counter() - start}),
                **(further or {}),
            }
            # What a signal does to Git may be in the provenance, or to a worker in the data.
            check_stop()
            made = told.result() | provenance.of_workers(crew)
            image.write(planned.target, attributes, config.resolved(), made)
        # Only now: a failure before this line leaves the parts for the next run.
        parts.drop()
        return str(attributes[DOUBT])


def _whole(experiment: str, content: ExperimentConfig, arithmetic: Arithmetic) -> Tree:
    """Compute an experiment on a worker of a cluster."""
    from rigidpend.experiments.contract import Means

    return experiments.computation(experiment).compute(content, Means(arithmetic))


def _pieces(
    parts: Parts,
    planned: Plan,
    scheduler: str | None,
    report: Callable[[str], None],
    crew: dict[str, int],
    jobs: int,
) -> Callable[[Sequence[Piece]], Iterator[Tree]]:
    """Choose who computes the pieces of an experiment: this process, or a cluster."""
    if scheduler is None:
        return partial(parts.in_order, jobs=jobs)
    from rigidpend.runs import cluster

    given = scheduler, planned.config.experiment, planned.config.engine, parts
    return lambda pieces: cluster.computed(*given, pieces, report, crew)


def doubt(data: Tree) -> str:
    """Count the symbols of a result that are uncertain, in words; empty where none is.

    They are those of every array of flags of the name `certain`.
    """
    import numpy as np

    arrays = (each for each in _named("certain", data) if isinstance(each, np.ndarray))
    flags = [each for each in arrays if each.dtype == bool]
    uncertain = sum(int(np.count_nonzero(~each)) for each in flags)
    return f"{uncertain} of {sum(map(np.size, flags))} symbols uncertain" if uncertain else ""


def _named(name: str, data: Tree) -> Iterator[Any]:
    """Values of all arrays of a name, in all groups."""
    for key, node in data.items():
        if isinstance(node, Mapping):
            yield from _named(name, node)
        elif key == name:
            yield node.values


def _arithmetic(planned: Plan) -> Arithmetic:
    """Arithmetic of a planned experiment, resolved once."""
    from rigidpend.orbits.integrate.arithmetic import CLOSED_FORM, resolve

    asked = planned.config.content.numerics_asked
    return resolve(**{**asked, "engine": planned.config.engine}) if asked else CLOSED_FORM


def _stored(arithmetic: Arithmetic, config: AnyConfig) -> dict[str, Any]:
    """Part of the arithmetic that a config can choose, as root attributes."""
    chosen = set(config.content.numerics_asked) - {"engine"}
    return {name: value for name, value in arithmetic._asdict().items() if name in chosen}


def _reason(stored: Mapping[str, Any], fingerprint: dict[str, str]) -> str:
    """Reason to compute a result, by the attributes of the one there; empty if up to date."""
    if not stored:
        return "no result yet"
    if OTHER in stored:
        return "its result has another format version"
    changed = [said for key, said in REASONS.items() if stored.get(key) != fingerprint[key]]
    return "; ".join(changed)


def _changed(target: Path, config: AnyConfig) -> str:
    """Reason that names the keys of the config that are others than in the result there."""
    from rigidpend.config import writer
    from rigidpend.results import store

    try:
        before = store.config(target)
    except store.StoreError:
        return REASONS["config_hash"]
    found = writer.changes(before, config.resolved())
    return (
        f"{REASONS['config_hash']}: {writer.sentence(found)}" if found else REASONS["config_hash"]
    )
