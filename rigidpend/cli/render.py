"""`rigidpend render`: draw stored results."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from rigidpend.cli.common import ABSENT, NAMES, OUT, SWEEPS, folder_of, guarded, say
from rigidpend.config import catalogue


@click.command("render")
@NAMES
@SWEEPS
@OUT
@click.option(
    "--format",
    "suffix",
    type=click.Choice(["png", "svg", "pdf"]),
    default="png",
    show_default=True,
    help="Format of the figure.",
)
@click.option("--force", is_flag=True, help="Draw figures that are up to date as well.")
@guarded
def command(
    names: tuple[str, ...], sweeps: tuple[str, ...], folder: Path, suffix: str, force: bool
) -> None:
    """Draw stored results as FOLDER/NAME.png, a RESULT.h5 beside itself.

    A figure of the same result, drawn by the same code, is kept. The results of a sweep are
    drawn one by one, and together where their experiment says how.

    \b
    Examples:
      rigidpend render all
      rigidpend render fig4 --format pdf
      rigidpend render fig4 --sweep problem.mu=1e-4,1e-3 --out swept
    """
    from rigidpend import render as drawing
    from rigidpend.config import names as known
    from rigidpend.machine.workers import check_stop

    for path in known.resolve(names, folder):
        title, members = _members(path, sweeps)
        sources = [folder_of(path, folder) / f"{name}.h5" for name in members]
        for source in sources:
            check_stop()
            _check_there(source, path.stem)
            target = source.parent / f"{source.stem}.{suffix}"
            _tell(source.stem, target, drawing.render(source, target, force=force))
        together = sources[0].parent / f"{title}.{suffix}"
        if len(sources) > 1:
            _tell(title, together, drawing.render_together(sources, together, force=force))


def _tell(name: str, target: Path, drawn: bool | None) -> None:
    if drawn is not None:
        say(f"{name}: {target} {'drawn' if drawn else 'up to date'}")


def _members(path: Path, sweeps: tuple[str, ...]) -> tuple[str, list[str]]:
    """Names of the results that a config stands for, and of all of them together."""
    # To draw one result its config need not be read, nor pydantic imported.
    if not sweeps and not (path.suffix != ".h5" and catalogue.is_sweep(path)):
        return path.stem, [path.stem]
    from rigidpend.runs import loading

    [group] = loading.load_groups([path], (), sweeps)
    return group.title, [each.name for each in group.members]


def _check_there(source: Path, name: str) -> None:
    if not os.path.lexists(source):
        say(f"rigidpend: {source} is not there; call: rigidpend run {name}")
        sys.exit(ABSENT)
