"""From configs to result files: what is up to date is left alone, with the reason said."""

from __future__ import annotations

import itertools
import json
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigidpend import experiments, provenance, store
from rigidpend.config import Config
from rigidpend.parts import Parts
from rigidpend.workers import side_by_side


@dataclass(frozen=True)
class Plan:
    """A config, the file that holds its result, and why it is to be run, if it is."""

    config: Config
    engine: str
    target: Path
    fingerprint: dict[str, str]
    """What the result depends on: hashes of config and code, and the engine."""
    reason: str
    """Why it must be computed; empty where the file is up to date."""


REASONS = {
    "config_hash": "its config changed",
    "code_hash": "the code that computes it changed",
    "engine": "the engine changed",
}


def plan(config: Config, folder: Path, *, force: bool = False) -> Plan:
    """Decide whether a config is to be run.

    Parameters
    ----------
    config : Config
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
    return Plan(config, engine, target, fingerprint, reason)


def run_all(plans: Sequence[Plan], *, jobs: int, say: Callable[[str], None]) -> None:
    """Run planned experiments side by side.

    Parameters
    ----------
    plans : sequence of Plan
    jobs : int
        How many experiments at a time, and threads or processes in each; no result depends on
        it. Most experiments are over before the next begins, so they do not share it out.
    say : callable
        Takes a line for people: what begins, how it goes, what is done, the time left.
    """
    begun, done = time.perf_counter(), itertools.count(1)

    def follow(planned: Plan) -> None:
        name, start = planned.config.name, time.perf_counter()
        say(f"{name}: computing ({planned.reason}), {planned.fingerprint['engine']}")
        run(planned, jobs=jobs, report=lambda text: say(f"{name}: {text}"))
        now = time.perf_counter()
        left = _left(next(done), len(plans), now - begun)
        say(f"{name}: {planned.target} written, {now - start:.2f} s{left}")

    side_by_side(follow, (), False, plans, jobs)


def _left(done: int, total: int, elapsed: float) -> str:
    """How many of several experiments are done and about how long the others take."""
    if done == total:
        return ""
    return f" ({done} of {total} done, about {elapsed / done * (total - done):.0f} s left)"


def run(planned: Plan, *, jobs: int, report: Callable[[str], None]) -> None:
    """Compute a planned experiment and write its result file.

    Raises
    ------
    StoreError
        The file cannot be written.
    """
    config = planned.config
    store.prepare(planned.target)
    parts = Parts(planned.target, provenance.config_hash(planned.fingerprint))
    means = experiments.Means(planned.engine, jobs, report, parts.keep)
    data = experiments.module(config.experiment).compute(config.content, means)
    attributes: dict[str, Any] = {
        "name": config.name,
        "figure": config.content.figure,
        "experiment": config.experiment,
        **planned.fingerprint,
        **_numerics(planned),
    }
    resolved = json.dumps(config.resolved(), indent=2)
    result = store.Result(attributes, resolved, provenance.provenance(), data)
    store.write(planned.target, result)
    parts.drop()


def verify(config: Config, stored: Path, *, jobs: int) -> list[str]:
    """Compute a config again and say where the stored result differs.

    Raises
    ------
    StoreError
        The stored result cannot be read.
    """
    differences = experiments.module(config.experiment).differences
    old = store.load(stored)
    with tempfile.TemporaryDirectory() as folder:
        planned = plan(config, Path(folder))
        run(planned, jobs=jobs, report=lambda _: None)
        new = store.load(planned.target)
    found: list[str] = []
    if old["attributes"]["config_hash"] != planned.fingerprint["config_hash"]:
        found.append("the config is not the one that the stored result was made from")
    return found + list(differences(old["data"], new["data"]))


def _numerics(planned: Plan) -> dict[str, Any]:
    """The tolerance and the precisions in force, what was automatic resolved."""
    from rigidpend.integrate.engines import DEFAULT_TOLERANCE

    numerics = getattr(planned.config.content, "numerics", None)
    if numerics is None:
        return {}
    tolerance = numerics.tolerance or DEFAULT_TOLERANCE[planned.engine]
    return {"tolerance": float(tolerance), "precisions": list(numerics.precisions)}


def _engine(config: Config) -> str:
    """The engine that a config is computed with; none for closed forms."""
    from rigidpend.integrate.engines import check_engine, default_engine

    numerics = getattr(config.content, "numerics", None)
    return check_engine(numerics.engine or default_engine()) if numerics else ""


def _reason(target: Path, fingerprint: dict[str, str]) -> str:
    """Why a target must be computed; empty where it is up to date.

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
