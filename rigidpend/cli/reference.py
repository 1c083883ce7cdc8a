"""`rigidpend reference`: renew the stored references that `verify` compares with."""

from __future__ import annotations

from pathlib import Path

import click

from rigidpend.cli import complete
from rigidpend.cli.common import FOLDER, JOBS, NAMED, guarded, say
from rigidpend.config.catalogue import REFERENCES


@click.command("reference")
@click.argument("names", nargs=-1, metavar=f"[{NAMED}|all]...", shell_complete=complete.names)
@click.option(
    "--reason", default="", help="Reason for the renewal; kept in the file, after earlier ones."
)
@click.option(
    "--reference",
    "folder",
    type=FOLDER,
    default=REFERENCES,
    show_default=True,
    help="Folder of the references.",
)
@JOBS
@guarded
def command(names: tuple[str, ...], reason: str, folder: Path, jobs: int) -> None:
    """Compute references again, all if none is named, and keep the reason in each file.

    \b
    Example:
      rigidpend reference fig4 --reason "n_symbols = 20"
    """
    from rigidpend.config.catalogue import resolve
    from rigidpend.runs import loading, regression

    # Not `required` of the option, for blanks are no reason either.
    if not reason.strip():
        raise click.UsageError("a reference is renewed for a reason: give it with --reason")
    paths = resolve(names or ("all",))
    for path in paths:
        loaded = loading.load(path)
        target = folder / f"{loaded.name}.h5"
        regression.renew(loaded, target, reason, jobs=jobs)
        say(f"{loaded.name}: {target} renewed")
