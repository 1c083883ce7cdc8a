"""Runner: from configs to result files; what is up to date is left alone."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend import experiments
from rigidpend.config import changes
from rigidpend.config.loading import LoadedConfig
from rigidpend.results import store
from rigidpend.results.tree import Tree
from rigidpend.run import provenance
from rigidpend.run.parts import Parts, sweep
from rigidpend.run.signals import termination

if TYPE_CHECKING:
    from rigidpend.integrate.arithmetic import Arithmetic


@dataclass(frozen=True)
class Plan:
    """Plan of a run: a config, the file of its result, and the reason to compute it, if any."""

    config: LoadedConfig
    engine: str
    target: Path
    fingerprint: dict[str, str]
    """Hashes of config and code, and the engine: all on which the result depends."""
    reason: str
    """Reason to compute the result; empty where the file is up to date."""
    doubt: str = ""
    """Count of what is uncertain in the result that is there, in words."""
    seconds: float = 0.0
    """Seconds that the result there took, if it is of the same config; else 0."""


OTHER = "of another version"
"""Mark of a result that cannot be read for its format version."""
SECONDS = "seconds"
"""Root attribute of the time that a result took, unless it went on from parts."""
DOUBT = "doubt"
"""Root attribute of what is uncertain."""
REASONS = {
    "config_hash": "its config changed",
    "code_hash": "the code that computes it changed",
    "engine": "the engine changed",
}


def plan(config: LoadedConfig, folder: Path, *, force: bool = False) -> Plan:
    """Decide whether a config is to be run; tidy up what a killed run left beside its result.

    Parameters
    ----------
    config : LoadedConfig
    folder : Path
        Where results are kept.
    force : bool, optional
        Compute even what is up to date.
    """
    engine = _engine(config)
    target = folder / f"{config.name}.h5"
    fingerprint = {
        "config_hash": provenance.config_hash(config.resolved()),
        "code_hash": provenance.code_hash(config.experiment),
        "engine": provenance.engine_name(engine),
    }
    stored = {} if force else _stored_attributes(target)
    reason = "--force" if force else _reason(stored, fingerprint)
    if stored.get("config_hash", fingerprint["config_hash"]) != fingerprint["config_hash"]:
        reason = reason.replace(REASONS["config_hash"], _changed(target, config))
    if not reason:
        sweep(target)
    same = stored.get("config_hash") == fingerprint["config_hash"]
    seconds = float(stored.get(SECONDS, 0.0)) if same else 0.0
    return Plan(config, engine, target, fingerprint, reason, str(stored.get(DOUBT, "")), seconds)


def expected_seconds(planned: Plan) -> float | None:
    """Estimate how long a plan takes to compute, in seconds; None where nothing tells.

    A result of the same problem says what it took, on whatever machine; else the experiment does.
    """
    if planned.seconds:
        return planned.seconds
    if not planned.reason:
        return None
    return experiments.cost(planned.config.experiment, planned.config.content)


def follow(planned: Plan, *, jobs: int, say: Callable[[str], None]) -> None:
    """Run a planned experiment and report its progress, each line beginning with its name.

    Parameters
    ----------
    planned : Plan
    jobs : int
        Threads or processes; no result depends on it.
    say : callable
        Takes lines of progress: the beginning with its reason, the parts, the end.

    Raises
    ------
    StoreError, WorkerError, ArithmeticError
        It cannot be computed or written. Finished parts are kept.
    """
    name, start = planned.config.name, time.perf_counter()
    engine = planned.fingerprint["engine"]
    say(f"{name}: computing ({planned.reason}), {engine}")
    with termination():
        told = run(planned, jobs=jobs, report=lambda text: say(f"{name}: {text}"))
    doubt = f"; {told}" if told else ""
    say(f"{name}: {planned.target} written, {time.perf_counter() - start:.2f} s{doubt}")


def run(
    planned: Plan,
    *,
    jobs: int,
    report: Callable[[str], None],
    further: Mapping[str, Any] | None = None,
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

    Returns
    -------
    str
        How many symbols are uncertain; empty where none is.

    Raises
    ------
    StoreError
        The file cannot be written.
    """
    config = planned.config
    store.prepare(planned.target)
    with Parts(planned.target, provenance.config_hash(planned.fingerprint)) as parts:
        start, resumed = time.perf_counter(), len(parts)
        if resumed:
            report(f"goes on from {len(parts)} finished part{'s' if len(parts) > 1 else ''}")
        # Imported here: a plan, which may find nothing to do, loads no arithmetic.
        from rigidpend.experiments.contract import Means

        arithmetic = _arithmetic(planned)
        means = Means(arithmetic, jobs, report, parts.keep)
        data = experiments.computation(config.experiment).compute(config.content, means)
        attributes: dict[str, Any] = {
            "name": config.name,
            "figure": config.content.figure,
            "experiment": config.experiment,
            **planned.fingerprint,
            **_stored(arithmetic, config),
            DOUBT: doubt(data),
            **({} if resumed else {SECONDS: time.perf_counter() - start}),
            **(further or {}),
        }
        resolved = json.dumps(config.resolved(), indent=2)
        result = store.Result(attributes, resolved, provenance.provenance(), data)
        store.write(planned.target, result)
        # Only now: a failure before this line leaves the parts for the next run.
        parts.drop()
        return str(attributes[DOUBT])


def doubt(data: Tree) -> str:
    """Count the symbols of a result that are uncertain, in words; empty where none is.

    They are those of every array of flags of the name `certain`.
    """
    flags = [each for each in _named("certain", data) if np.asarray(each).dtype == bool]
    uncertain = sum(int(np.count_nonzero(~np.asarray(each))) for each in flags)
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
    from rigidpend.integrate.arithmetic import CLOSED_FORM, resolve

    if not planned.engine:
        return CLOSED_FORM
    return resolve(**{**planned.config.content.numerics_asked, "engine": planned.engine})


def _stored(arithmetic: Arithmetic, config: LoadedConfig) -> dict[str, Any]:
    """Part of the arithmetic that a config can choose, as root attributes."""
    chosen = set(config.content.numerics_asked) - {"engine"}
    return {name: value for name, value in arithmetic._asdict().items() if name in chosen}


def _engine(config: LoadedConfig) -> str:
    """Engine that a config is computed with; empty for closed forms."""
    from rigidpend.integrate.engines import check_engine, default_engine

    asked = config.content.numerics_asked
    return check_engine(asked["engine"] or default_engine()) if asked else ""


def _reason(stored: Mapping[str, Any], fingerprint: dict[str, str]) -> str:
    """Reason to compute a result, by the attributes of the one there; empty if up to date."""
    if not stored:
        return "no result yet"
    if OTHER in stored:
        return "its result has another format version"
    changed = [said for key, said in REASONS.items() if stored.get(key) != fingerprint[key]]
    return "; ".join(changed)


def _changed(target: Path, config: LoadedConfig) -> str:
    """Reason that names the keys of the config that are others than in the result there."""
    try:
        before = json.loads(store.config(target))
    except (store.StoreError, ValueError):
        return REASONS["config_hash"]
    found = changes.changes(before, config.resolved())
    return (
        f"{REASONS['config_hash']}: {changes.sentence(found)}" if found else REASONS["config_hash"]
    )


def _stored_attributes(target: Path) -> dict[str, Any]:
    """Attributes of the result in a place; empty where there is none.

    Raises
    ------
    StoreError
        There is a file in its place that is no result of ours, or is damaged.
    """
    if not target.exists():
        return {}
    try:
        return store.attributes(target)
    except store.OtherVersion:
        return {OTHER: True}
    except store.StoreError as error:
        raise store.StoreError(f"{error}; move it away, or overwrite it with --force") from None
