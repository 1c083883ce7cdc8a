"""Shell completion of names of configs and of their keys."""

from __future__ import annotations

from pathlib import Path

import click
from click.shell_completion import CompletionItem

from rigidpend.config import catalogue


def names(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Offer names of configs, or files where no name begins so."""
    found = [name for name in ("all", *catalogue.known()) if name.startswith(incomplete)]
    return [*map(CompletionItem, found)] or [CompletionItem(incomplete, type="file")]


def settings(ctx: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Offer the keys of the configs that are named."""
    known = catalogue.known()
    # While a line is being typed, click leaves its arguments here.
    files = [known.get(name, Path(name)) for name in ctx.args]
    keys = dict.fromkeys(key for file in files if file.is_file() for key in _keys(file))
    return [CompletionItem(key) for key in keys if key.startswith(incomplete)]


def _keys(file: Path) -> list[str]:
    """List ``a.b=`` for each value of a file, except those inside lists."""
    # Imported here: only who completes a key pays for it.
    from rigidpend.config import reader
    from rigidpend.config.complaints import ConfigError

    try:
        values = reader.read(file).values
    # While somebody types there is no place for a complaint.
    except ConfigError:
        return []
    # What has keys inside is a section, which no setting gives as a whole.
    inner = {place[:-1] for place in values if place and isinstance(place[-1], str)}
    places = [place for place in values if place not in inner]
    return [f"{'.'.join(map(str, p))}=" for p in places if all(isinstance(x, str) for x in p)]
