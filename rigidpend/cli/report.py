"""`rigidpend report`: one HTML page of all results."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from rigidpend.cli import complete
from rigidpend.cli.common import DONE, FAILED, FILE, OUT, folder_of, guarded, say


@click.command("report")
@click.argument("names", nargs=-1, metavar="[NAME|RESULT.h5]...", shell_complete=complete.names)
@OUT
@click.option(
    "--to",
    "target",
    type=FILE,
    help="File of the page; report.html in the folder of the results if not given.",
)
@guarded
def command(names: tuple[str, ...], folder: Path, target: Path | None) -> None:
    """Write one page with every result: figures, numbers beside the paper's, provenance.

    With names it has these results only.

    The page needs no other file, no network and no script. Of a result that cannot be shown it
    says why, and the exit code is 1.

    \b
    Examples:
      rigidpend report
      rigidpend report --out results/reference --to reference.html
      rigidpend report fig4 fig5 --to two.html
    """
    from rigidpend.config.catalogue import resolve
    from rigidpend.render import report

    path = target or folder / "report.html"
    if names:
        given = resolve(names, folder)
        sources = [folder_of(x, folder) / f"{x.stem}.h5" for x in given]
    else:
        sources = report.results(folder)
    problems = report.write(sources, path)
    for problem in problems:
        say(f"rigidpend: {problem}")
    say(f"{path} written")
    sys.exit(FAILED if problems else DONE)
