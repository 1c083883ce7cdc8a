"""`rigidpend render`: draw stored results."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from rigidpend.cli.common import ABSENT, NAMES, OUT, folder_of, guarded, say


@click.command("render")
@NAMES
@OUT
@click.option(
    "--format",
    "suffix",
    type=click.Choice(["png", "svg", "pdf"]),
    default="png",
    show_default=True,
    help="Format of the figure.",
)
@guarded
def command(names: tuple[str, ...], folder: Path, suffix: str) -> None:
    """Draw stored results as FOLDER/NAME.png, a RESULT.h5 beside itself.

    \b
    Examples:
      rigidpend render all
      rigidpend render fig4 --format pdf
    """
    from rigidpend import render as drawing
    from rigidpend.config import names as known

    for path in known.resolve(names, folder):
        source = folder_of(path, folder) / f"{path.stem}.h5"
        if not os.path.lexists(source):
            say(f"rigidpend: {source} is not there; call: rigidpend run {path.stem}")
            sys.exit(ABSENT)
        target = source.with_suffix(f".{suffix}")
        drawing.render(source, target)
        say(f"{path.stem}: {target} drawn")
