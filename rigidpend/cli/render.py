"""`rigidpend render`, `report`: stored results drawn, and one HTML page of all."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from rigidpend.cli.common import (
    ABSENT,
    DONE,
    FAILED,
    folder_of,
    say,
    sentence,
)
from rigidpend.cli.options import FILE, NAMES, OUT, SWEEPS, complete_names
from rigidpend.config import catalogue

FEW = 3
"""Figures that are drawn one after the other; more share the processors."""


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
def render_command(
    names: tuple[str, ...], sweeps: tuple[str, ...], folder: Path, suffix: str, force: bool
) -> None:
    """Draw stored results as FOLDER/NAME.png, a RESULT.h5 beside itself.

    A figure of the same result, drawn by the same code, is kept. The results of a sweep are
    drawn one by one.

    A result that is absent or damaged does not keep the others from being drawn; how to make it is
    said at the end. Exit code 1: one is damaged; 3: one that was named, or everything, is absent.

    \b
    Examples:
      rigidpend render all
      rigidpend render fig4 --format pdf
      rigidpend render fig4 --sweep problem.mu=1e-4,1e-3 --out swept
    """
    from rigidpend.machine.workers import cores, side_by_side

    absent: dict[Path, list[Path]] = {}
    # Each once, in the order in which they are named.
    sources: dict[Path, None] = {}
    for path in catalogue.resolve(names, folder):
        members = [folder_of(path, folder) / f"{name}.h5" for name in _members(path, sweeps)]
        if lacking := [source for source in members if not os.path.lexists(source)]:
            absent[path] = lacking
        sources |= dict.fromkeys(source for source in members if source not in lacking)
    # To import what draws takes a process as long as some figures.
    new = sum(force or not source.with_suffix(f".{suffix}").exists() for source in sources)
    jobs = cores() if new > FEW else 1
    drawn = side_by_side(_drawn, (suffix, force), True, list(sources), jobs)
    if absent:
        _tell_absent(absent, sweeps, folder)
    if not all(drawn):
        sys.exit(FAILED)
    if absent and not (drawn and "all" in names):
        sys.exit(ABSENT)


def _drawn(source: Path, suffix: str, force: bool) -> bool:
    """Draw a result; where that fails say why."""
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


def _tell_absent(absent: dict[Path, list[Path]], sweeps: tuple[str, ...], folder: Path) -> None:
    """Say which results are absent, and the command that makes them."""
    from rigidpend.runs import remedies

    files = [str(file) for each in absent.values() for file in each]
    known = catalogue.known()
    names = [path.stem if known.get(path.stem) == path else str(path) for path in absent]
    swept = [word for each in sweeps for word in ("--sweep", each)]
    are = "is" if len(files) == 1 else "are"
    call = remedies.call("run", [*names, *swept], folder)
    say(f"rigidpend: {', '.join(files)} {are} not there; {call}")


def _members(path: Path, sweeps: tuple[str, ...]) -> list[str]:
    """Names of the results that a config stands for."""
    # To draw one result its config need not be read, nor pydantic imported.
    if not sweeps and not (path.suffix != ".h5" and catalogue.is_sweep(path)):
        return [path.stem]
    from rigidpend.runs import loading

    [group] = loading.load_groups([path], (), sweeps)
    return [each.name for each in group.members]


@click.command("report")
@click.argument("names", nargs=-1, metavar="[NAME|RESULT.h5]...", shell_complete=complete_names)
@OUT
@click.option(
    "--to",
    "target",
    type=FILE,
    help="File of the page; report.html in the folder of the results if not given.",
)
def report_command(names: tuple[str, ...], folder: Path, target: Path | None) -> None:
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
    from rigidpend.render import report

    path = target or folder / "report.html"
    given = catalogue.resolve(names, folder)
    sources = [folder_of(x, folder) / f"{x.stem}.h5" for x in given] or report.results(folder)
    problems = report.write(sources, path)
    for problem in problems:
        say(f"rigidpend: {problem}")
    say(f"{path} written")
    sys.exit(FAILED if problems else DONE)
