"""`rigidpend report`: one HTML page of all results."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from rigidpend.cli.common import DONE, FAILED, FILE, OUT, guarded, say


@click.command("report")
@OUT
@click.option(
    "--to",
    "target",
    type=FILE,
    help="File of the page; report.html in the folder of the results if not given.",
)
@guarded
def command(folder: Path, target: Path | None) -> None:
    """Write one page with every result: figures, numbers beside the paper's, provenance.

    The page needs no other file, no network and no script. Of a result that cannot be shown it
    says why, and the exit code is 1.

    \b
    Examples:
      rigidpend report
      rigidpend report --out results/reference --to reference.html
    """
    from rigidpend import report

    path = target or folder / "report.html"
    problems = report.write(folder, path)
    for problem in problems:
        say(f"rigidpend: {problem}")
    say(f"{path} written")
    sys.exit(FAILED if problems else DONE)
