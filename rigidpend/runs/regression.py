"""References: stored results that fresh ones are compared with, and how they are renewed."""

from __future__ import annotations

import contextlib
import datetime
import tempfile
from pathlib import Path
from typing import Any

from rigidpend import experiments
from rigidpend.experiments.data import compare
from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine import files
from rigidpend.machine.progress import tell_nobody
from rigidpend.results import store
from rigidpend.runs import certificate_files as storage
from rigidpend.runs.loading import LoadedConfig
from rigidpend.runs.runner import plan, run


class NoReference(files.Absent):
    """Error: nothing that a result could be compared with."""


def verify(
    config: LoadedConfig,
    stored: Path,
    *,
    jobs: int,
    fresh: Path | None = None,
    certificate: Loaded | None = None,
) -> list[str]:
    """Say where a stored result differs, by value, from a fresh one.

    Parameters
    ----------
    config : LoadedConfig
    stored : Path
        The reference.
    jobs : int
    fresh : Path, optional
        A result to be read; by default it is computed.
    certificate : Loaded, optional
        Proven symbols, which those of the fresh result must not contradict.

    Returns
    -------
    list of str
        First in what the files consist of, attributes and config included; where that is the
        same, in the values, each array with its worst element.

    Raises
    ------
    StoreError
        A file cannot be read.
    """
    old = store.load(stored)
    with tempfile.TemporaryDirectory() as folder:
        if fresh is None:
            planned = plan(config, Path(folder))
            run(planned, jobs=jobs, report=tell_nobody)
            fresh = planned.target
        new = store.load(fresh)
        outlines = store.outline(stored), store.outline(fresh)
    configs = old["config"], new["config"]
    same_numerics = configs[0].get("numerics") == configs[1].get("numerics")
    found: list[str] = [*compare.outlines(*outlines, same_numerics=same_numerics)]
    found += compare.plain(_problem(configs[0]), _problem(configs[1]), "config")
    # Values are compared place by place, which only equal structures allow.
    if outlines[0].keys() == outlines[1].keys():
        layout = experiments.layout(config.experiment)
        found += compare.differences(layout, old["data"], new["data"])
    if certificate:
        found += storage.contradictions(new, certificate)
    return found


def is_of(config: LoadedConfig, stored: Path) -> bool:
    """True if a stored result answers the problem of a config, by whatever numerics.

    Raises
    ------
    StoreError
        The file cannot be read.
    """
    if not stored.exists():
        return False
    return _problem(store.load(stored)["config"]) == _problem(config.resolved())


def verify_by_engines(config: LoadedConfig, *, jobs: int) -> list[str]:
    """Say where the two engines, Taylor series and DOP853, disagree on a config.

    Returns
    -------
    list of str
        As of :func:`verify`; the Taylor engine's result is called stored.

    Raises
    ------
    NoReference
        The experiment is in closed form: there is no second engine.
    EngineError
        llvmlite, which engine `taylor` needs, is not installed.
    """
    if not config.content.numerics_asked:
        raise NoReference(
            f"{config.name} has no stored reference, and is in closed form: no second engine"
            " computes one"
        )
    with tempfile.TemporaryDirectory() as folder:
        first = plan(config.with_engine("taylor"), Path(folder))
        run(first, jobs=jobs, report=tell_nobody)
        return verify(config.with_engine("scipy"), first.target, jobs=jobs)


def _problem(config: dict[str, Any]) -> dict[str, Any]:
    """Problem of a config: without its numerics, and the name of its figure."""
    return {key: x for key, x in config.items() if key not in ("numerics", "figure")}


def renew(config: LoadedConfig, target: Path, reason: str, *, jobs: int) -> None:
    """Compute a reference again; its attribute `reasons` keeps why, and the reasons before.

    Parameters
    ----------
    config : LoadedConfig
    target : Path
        The reference file, ``NAME.h5``.
    reason : str
    jobs : int

    Raises
    ------
    StoreError
        The file cannot be written.
    """
    before: list[str] = []
    # One that is absent or damaged is renewed as well, with no earlier reasons to keep.
    with contextlib.suppress(store.StoreError):
        before = list(store.attributes(target).get("reasons", []))
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    planned = plan(config, target.parent, force=True)
    reasons = [*before, f"{today} {' '.join(reason.split())}"]
    run(planned, jobs=jobs, report=tell_nobody, further={"reasons": reasons})
