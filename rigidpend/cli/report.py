"""`rigidpend report`: one HTML page of all results."""

from __future__ import annotations

from pathlib import Path

import click

from rigidpend.cli.common import OUT, guarded, say


@click.command("report")
@OUT
@click.option(
    "--to",
    "target",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File of the page; report.html in the folder of the results if not given.",
)
@guarded
def command(folder: Path, target: Path | None) -> None:
    """Write one page with every result: figures, numbers beside the paper's, provenance.

    The page needs no other file, no network and no script.

    \b
    Examples:
      rigidpend report
      rigidpend report --out results/reference --to reference.html
    """
    from rigidpend import report

    path = target or folder / "report.html"
    report.write(folder, path)
    say(f"{path} written")
