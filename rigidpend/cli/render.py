"""`rigidpend render`, `report`: stored results drawn, and one HTML page of all."""

import os
import sys
from collections.abc import Mapping
from pathlib import Path

import click

from rigidpend.cli.common import ABSENT, DONE, FAILED, folder_of, say, sentence
from rigidpend.cli.options import FILE, NAMES, OUT, complete_names
from rigidpend.config import catalogue

FEW = 3
"""Largest number of figures that one process draws; more share the processors."""


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
@click.option("--force", is_flag=True, help="Draw figures that are up to date as well.")
def render_command(names: tuple[str, ...], folder: Path, suffix: str, force: bool) -> None:
    """Draw stored results as FOLDER/NAME.png, or a RESULT.h5 as a figure beside it.

    A figure that the same code has drawn of the same result is left alone.

    If a result is absent or damaged, the others are drawn all the same, and advice on making it
    comes last. Exit code 1: a result is damaged; 3: a named result, or every result, is absent.

    \b
    Examples:
      rigidpend render all
      rigidpend render fig4 --format pdf
      rigidpend render swept/fig4_mu=1e-4.h5 swept/fig4_mu=1e-3.h5
    """
    from rigidpend.machine.workers import cores, side_by_side

    # Each once, in the order in which they are named.
    paths = _paths(names, folder)
    absent = {source: x for source, x in paths.items() if not os.path.lexists(source)}
    sources = [source for source in paths if source not in absent]
    # In a new process, importing the drawing libraries takes as long as several figures.
    new = sum(force or not source.with_suffix(f".{suffix}").exists() for source in sources)
    jobs = cores() if new > FEW else 1
    drawn = side_by_side(_drawn, (suffix, force), True, sources, jobs)
    if absent:
        _tell_absent(absent, folder)
    if not all(drawn):
        sys.exit(FAILED)
    # Of `all` some may be absent, which have not been run yet.
    named = _paths(tuple(x for x in names if x != "all"), folder)
    if absent and (not drawn or not absent.keys().isdisjoint(named)):
        sys.exit(ABSENT)


def _paths(names: tuple[str, ...], folder: Path) -> dict[Path, Path]:
    """The file of each result, with what it is named by, in the order of the names."""
    given = catalogue.resolve(names, folder, absent=True)
    return {folder_of(x, folder) / f"{x.stem}.h5": x for x in given}


def _drawn(source: Path, suffix: str, force: bool) -> bool:
    """Draw a result, or report the failure."""
    from rigidpend import render as drawing
    from rigidpend.machine.files import StoreError
    from rigidpend.machine.workers import check_stop

    check_stop()
    target = source.with_suffix(f".{suffix}")
    try:
        drawn = drawing.render(source, target, force=force)
    except StoreError as error:
        say(f"rigidpend: {sentence(error)}")
        return False
    say(f"{source.stem}: {target} {'drawn' if drawn else 'up to date'}")
    return True


def _tell_absent(absent: Mapping[Path, Path], folder: Path) -> None:
    """Report the results that are not there, and the commands that make these."""
    known = catalogue.known()
    configs = [x for x in absent.values() if x.suffix != ".h5"]
    names = [x.stem if known.get(x.stem) == x else str(x) for x in configs]
    files, are = ", ".join(map(str, absent)), "is" if len(absent) == 1 else "are"
    mends = [catalogue.call("run", names, folder)] if names else []
    mends += [catalogue.remedy(x) for x in absent.values() if x.suffix == ".h5"]
    say("; ".join([f"rigidpend: {files} {are} not there", *filter(None, mends)]))


@click.command("report")
@click.argument("names", nargs=-1, metavar="[NAME|RESULT.h5]...", shell_complete=complete_names)
@OUT
@click.option(
    "--to",
    "target",
    type=FILE,
    help="File of the page, X.html; report.html in the folder of the results if not given.",
)
def report_command(names: tuple[str, ...], folder: Path, target: Path | None) -> None:
    """Write one page with every result: figures, numbers beside the paper's, provenance.

    With names the page has only these results.

    The page needs no other file, no network and no script. If a result cannot be shown, the page
    says why, and the exit code is 1; without any result there is no page, and it is 3.

    \b
    Examples:
      rigidpend report
      rigidpend report --out results/reference --to reference.html
      rigidpend report fig4 fig5 --to two.html
    """
    from rigidpend.render import report

    path = target or folder / "report.html"
    # A name of another kind may be that of a result or a config, which the page would replace.
    if path.suffix != ".html":
        raise click.UsageError(f"{path}: the name of a page ends in .html")
    given = catalogue.resolve(names, folder, absent=True)
    sources = [folder_of(x, folder) / f"{x.stem}.h5" for x in given] or report.results(folder)
    problems = report.write(sources, path)
    for problem in problems:
        say(f"rigidpend: {problem}")
    say(f"{path} written")
    sys.exit(FAILED if problems else DONE)
