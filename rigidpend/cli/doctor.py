"""`rigidpend doctor`: the libraries, processors and folders here, and what is missing of them."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import click

from rigidpend.cli.common import ABSENT, DONE, JSON, OUT, guarded, print_json, print_table

EXTRAS = {
    "xarray": ("notebook", "no results as labelled arrays, result.data"),
    "distributed": ("cluster", "no --scheduler"),
    "heyoka": ("bench", "one peer less in rigidpend bench; no result needs it"),
}
"""Libraries that may be missing: the extra that has each, and what that costs."""
AGAIN = "every run needs it: python -m pip install --force-reinstall rigidpend"


class Finding(NamedTuple):
    """A line of what is here."""

    name: str
    state: str
    note: str = ""
    needed: bool = False
    """True of what is missing, and no run does without."""


@click.command("doctor")
@OUT
@JSON
@guarded
def command(folder: Path, as_json: bool) -> None:
    """Print what is installed here, what is missing, and what that costs.

    Versions, processors, the cache, and whether results can be written. Ends with 3 where
    something is missing that every run needs.

    \b
    Example:
      rigidpend doctor
    """
    found = [*_machine(), *_libraries(), *_folders(folder)]
    if as_json:
        print_json([each._asdict() for each in found])
    else:
        print_table([each[:3] for each in found])
    sys.exit(ABSENT if any(each.needed for each in found) else DONE)


def _machine() -> Iterator[Finding]:
    from rigidpend.machine.workers import cores
    from rigidpend.runs import provenance

    facts = provenance.provenance()
    yield Finding("rigidpend", facts["version_rigidpend"], f"commit {facts['commit']}")
    yield Finding("Python", facts["version_python"], facts["system"])
    yield Finding("processors", str(cores()), facts["processor"])


def _libraries() -> Iterator[Finding]:
    from rigidpend.runs import provenance

    for name in (*provenance.LIBRARIES, "matplotlib"):
        version = provenance.version(name)
        lacking = version == provenance.ABSENT
        yield Finding(name, version, AGAIN if lacking else "", lacking)
    for name, (extra, cost) in EXTRAS.items():
        version = provenance.version(name)
        mend = f"{cost}; python -m pip install 'rigidpend[{extra}]'"
        yield Finding(name, version, mend if version == provenance.ABSENT else "")


def _folders(results: Path) -> Iterator[Finding]:
    from rigidpend.machine import cache

    size = sum(each.size for each in cache.subfolders())
    cost = "code and maps are made anew by each run, which takes seconds: set XDG_CACHE_HOME"
    ready = _writable(cache.folder())
    state = f"{size / 1e6:.0f} MB" if ready else "cannot be written"
    yield Finding("cache", state, f"{cache.folder()}{'' if ready else f'; {cost}'}")
    ready = _writable(results)
    mend = "" if ready else "; choose another folder with --out"
    yield Finding(
        "results", "ready" if ready else "cannot be written", f"{results}{mend}", not ready
    )


def _writable(folder: Path) -> bool:
    """True if files can be made in a folder, or the folder itself where it is not there yet."""
    near = next(each for each in (folder, *folder.absolute().parents) if each.exists())
    return near.is_dir() and os.access(near, os.W_OK)
