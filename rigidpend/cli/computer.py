"""`rigidpend cache`, `doctor`: the cache and the installation on this machine."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import click

from rigidpend.cli.common import ABSENT, DONE, print_json, print_table, say
from rigidpend.cli.options import JSON, OUT
from rigidpend.machine.wording import counted


@click.command("cache")
@click.option("--clear", is_flag=True, help="Remove the whole cache.")
@JSON
def cache_command(clear: bool, as_json: bool) -> None:
    """Print the folder of the cache, with its subfolders and their sizes.

    It holds compiled code, return maps and hashes of code, which are made again when they
    are needed. Each file names its origin, under a digest; a file that is damaged or of another
    origin is reported and made again.

    \b
    Examples:
      rigidpend cache
      rigidpend cache --clear
    """
    from rigidpend.machine import cache

    found = cache.subfolders()
    whole = f"{cache.folder()}: {_size(sum(one.bytes for one in found))}"
    if clear:
        cache.clear()
        say(f"{whole} removed")
    elif as_json:
        print_json({"folder": cache.folder(), "subfolders": [x._asdict() for x in found]})
    else:
        click.echo(whole)
        if found:
            print_table(
                [(x.name, counted(len(x.files), "file"), _size(x.bytes), x.meaning) for x in found]
            )


def _size(count: int) -> str:
    """A number of bytes with its unit; a megabyte is 10^6 bytes."""
    return f"{count / 1e6:.1f} MB" if count >= 1e5 else f"{count} bytes"


EXTRAS = {
    "xarray": ("notebook", "no results as labelled arrays, result.data"),
    "distributed": ("cluster", "no --scheduler"),
    "heyoka": ("bench", "rigidpend bench does not run; no result needs it"),
}
"""Optional libraries: the extra that has each, and the consequence if it is missing."""
AGAIN = "every run needs it: python -m pip install --force-reinstall rigidpend"


class Finding(NamedTuple):
    """A line on this machine or installation."""

    name: str
    state: str
    note: str = ""
    needed: bool = False
    """True if something is missing that every run needs."""


@click.command("doctor")
@OUT
@JSON
def doctor_command(folder: Path, as_json: bool) -> None:
    """Print what is installed here, what is missing, and the consequences.

    It lists versions, processors, the cache, and whether results can be written. Exit code 3:
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
        lacking = version == provenance.MISSING
        yield Finding(name, version, AGAIN if lacking else "", lacking)
    for name, (extra, cost) in EXTRAS.items():
        version = provenance.version(name)
        mend = f"{cost}; python -m pip install 'rigidpend[{extra}]'"
        yield Finding(name, version, mend if version == provenance.MISSING else "")


def _folders(results: Path) -> Iterator[Finding]:
    from rigidpend.machine import cache

    size = sum(each.bytes for each in cache.subfolders())
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
    """True if files can be made in a folder, or the folder itself if it does not exist."""
    near = next(each for each in (folder, *folder.absolute().parents) if each.exists())
    return near.is_dir() and os.access(near, os.W_OK)
