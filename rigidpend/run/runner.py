"""Runner: from configs to result files; what is up to date is left alone."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidpend import experiments
from rigidpend.config.loading import LoadedConfig
from rigidpend.results import store
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
    reason = "--force" if force else _reason(target, fingerprint)
    if not reason:
        sweep(target)
    return Plan(config, engine, target, fingerprint, reason)


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
        run(planned, jobs=jobs, report=lambda text: say(f"{name}: {text}"))
    say(f"{name}: {planned.target} written, {time.perf_counter() - start:.2f} s")


def run(
    planned: Plan,
    *,
    jobs: int,
    report: Callable[[str], None],
    further: Mapping[str, Any] | None = None,
) -> None:
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

    Raises
    ------
    StoreError
        The file cannot be written.
    """
    config = planned.config
    store.prepare(planned.target)
    with Parts(planned.target, provenance.config_hash(planned.fingerprint)) as parts:
        if len(parts):
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
            **(further or {}),
        }
        resolved = json.dumps(config.resolved(), indent=2)
        result = store.Result(attributes, resolved, provenance.provenance(), data)
        store.write(planned.target, result)
        # Only now: a failure before this line leaves the parts for the next run.
        parts.drop()


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


def _reason(target: Path, fingerprint: dict[str, str]) -> str:
    """Reason to compute a target; empty where it is up to date.

    Raises
    ------
    StoreError
        There is a file in its place that is no result of ours, or is damaged.
    """
    if not target.exists():
        return "no result yet"
    try:
        stored = store.attributes(target)
    except store.OtherVersion:
        return "its result has another format version"
    except store.StoreError as error:
        raise store.StoreError(f"{error}; move it away, or overwrite it with --force") from None
    changed = [said for key, said in REASONS.items() if stored.get(key) != fingerprint[key]]
    return "; ".join(changed)
