"""`rigidpend verify`: stored results against fresh ones."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from rigidpend.cli.common import DONE, FAILED, JOBS, NAMES, guarded


@click.command("verify")
@NAMES
@click.option(
    "--reference",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results/reference"),
    show_default=True,
    help="Folder of the stored results.",
)
@JOBS
@guarded
def command(names: tuple[str, ...], reference: Path, jobs: int | None) -> None:
    """Compute experiments again and compare them by value with stored results.

    \b
    Example:
      rigidpend verify all
    """
    from rigidpend import config, runner, workers

    differing = False
    for path in config.names.resolve(names):
        loaded = config.load(path)
        stored = reference / f"{loaded.name}.h5"
        found = runner.verify(loaded, stored, jobs=jobs or workers.cores())
        differing |= bool(found)
        click.echo(f"{loaded.name}: {'differs from' if found else 'the same as in'} {stored}")
        for difference in found:
            click.echo(f"  {difference}")
    sys.exit(FAILED if differing else DONE)
