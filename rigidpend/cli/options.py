"""Options and arguments that commands share, with their completion in a shell."""

from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from rigidpend.config import catalogue

NAMED = "NAME|FILE.yaml|RESULT.h5"
"""Forms that name a config: a known name, a file, or a result that contains it."""


class NamedPath(click.Path):
    """Type of an option for a file or a folder; an empty text is refused."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not str(value):
            self.fail(f"expected the name of a {self.name}, got empty text", param, ctx)
        return super().convert(value, param, ctx)


def complete_names(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Offer names of configs, or files if no name begins with the given text."""
    found = [name for name in ("all", *catalogue.known()) if name.startswith(incomplete)]
    return [*map(CompletionItem, found)] or [CompletionItem(incomplete, type="file")]


FOLDER = NamedPath(file_okay=False, path_type=Path)
FILE = NamedPath(dir_okay=False, path_type=Path)
OUT = click.option(
    "--out",
    "folder",
    type=FOLDER,
    default=catalogue.RESULTS,
    show_default=True,
    help="Folder of the results.",
)
NAMES = click.argument(
    "names", nargs=-1, required=True, metavar=f"{NAMED}...", shell_complete=complete_names
)
SETTINGS = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="a.b=VALUE",
    help="Override a value of the config; may be given again.",
)
SWEEPS = click.option(
    "--sweep",
    "sweeps",
    multiple=True,
    metavar="a.b=VALUE,VALUE...",
    help="A result for each of the values, and for each combination if given again.",
)


def _cores() -> int:
    from rigidpend.machine import workers

    return workers.cores()


JOBS = click.option(
    "-j",
    "--jobs",
    type=click.IntRange(1),
    default=_cores,
    help="Threads; all processors if not given.",
)


def _scheduler(ctx: click.Context, _: click.Parameter, address: str | None) -> str | None:
    """Refuse an address that no scheduler can have, or any if Dask's client is not installed."""
    if address is not None and not ctx.resilient_parsing:
        from rigidpend.runs import cluster

        if said := cluster.complaint(address):
            raise click.UsageError(f"--scheduler: {said}")
        cluster.check_extra()
    return address


SCHEDULER = click.option(
    "--scheduler",
    metavar="ADDRESS",
    callback=_scheduler,
    help="Compute on the workers of a Dask scheduler, as at tcp://host:8786 (extra `cluster`).",
)
JSON = click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
