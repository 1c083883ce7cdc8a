"""`rigidpend cache`: what is kept to be faster the next time, and its removal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from rigidpend.cli.common import JSON, guarded, print_json, print_table, say

if TYPE_CHECKING:
    from rigidpend.machine.cache import Subfolder


@click.command("cache")
@click.option("--clear", is_flag=True, help="Remove the whole cache.")
@click.option("--files", "each", is_flag=True, help="Print every file, not the subfolders alone.")
@JSON
@guarded
def command(clear: bool, each: bool, as_json: bool) -> None:
    """Print the folder of the cache, with its subfolders and their sizes.

    It holds compiled code, return maps and what plans found out, which are made again when they
    are needed. Each file says what it is of, under a digest; one that is damaged, or of something
    else, is told and made again.

    \b
    Examples:
      rigidpend cache
      rigidpend cache --files
      rigidpend cache --clear
    """
    from rigidpend.machine import cache

    found = cache.subfolders()
    if clear:
        cache.clear()
        say(f"{cache.folder()}: {_size(sum(one.size for one in found))} removed")
    elif as_json:
        print_json({"folder": str(cache.folder()), "subfolders": [_document(x) for x in found]})
    else:
        click.echo(f"{cache.folder()}: {_size(sum(one.size for one in found))}")
        if found:
            print_table([_row(one) for one in found])
        # Damaged files are named even where files are only counted: they are what to act on.
        for path in (path for one in found for path in one.files if each or path in one.damaged):
            damaged = any(path in one.damaged for one in found)
            click.echo(f"{path}  {_size(path.stat().st_size)}{'  damaged' if damaged else ''}")


def _row(one: Subfolder) -> list[str]:
    damaged = f", {len(one.damaged)} damaged" if one.damaged else ""
    return [one.path.name, f"{len(one.files)} files{damaged}", _size(one.size), one.meaning]


def _document(one: Subfolder) -> dict[str, Any]:
    return {
        "name": one.path.name,
        "meaning": one.meaning,
        "bytes": one.size,
        "files": [str(path) for path in one.files],
        "damaged": [str(path) for path in one.damaged],
    }


def _size(count: int) -> str:
    """Bytes in words; a megabyte is 10^6 of them."""
    return f"{count / 1e6:.1f} MB" if count >= 1e5 else f"{count} bytes"
