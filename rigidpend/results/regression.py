"""References: stored results that fresh ones are compared with, and how they are renewed."""

from __future__ import annotations

import contextlib
import datetime
import json
import tempfile
from pathlib import Path

from rigidpend import experiments
from rigidpend.certified import storage
from rigidpend.config.loading import LoadedConfig
from rigidpend.results import compare, store
from rigidpend.results.tree import Loaded
from rigidpend.run.runner import plan, run


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
            run(planned, jobs=jobs, report=_nowhere)
            fresh = planned.target
        new = store.load(fresh)
        outlines = store.outline(stored), store.outline(fresh)
    found: list[str] = [*compare.outlines(*outlines)]
    found += compare.plain(json.loads(old["config"]), json.loads(new["config"]), "config")
    if outlines[0].keys() == outlines[1].keys():
        found += experiments.computation(config.experiment).differences(old["data"], new["data"])
    if certificate:
        found += storage.contradictions(new, certificate)
    return found


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
    with contextlib.suppress(store.StoreError):
        before = list(store.attributes(target).get("reasons", []))
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    planned = plan(config, target.parent, force=True)
    reasons = [*before, f"{today} {' '.join(reason.split())}"]
    run(planned, jobs=jobs, report=_nowhere, further={"reasons": reasons})


def _nowhere(_: str) -> None:
    """Drop a line of progress."""
