"""`rigidpend bench`, `stress`: measurements on this machine, and trials at the limits."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rigidpend.cli.common import DONE, FAILED, print_json, say
from rigidpend.cli.options import JOBS, JSON, OUT, SETTINGS
from rigidpend.config.catalogue import resolve
from rigidpend.machine import wording
from rigidpend.machine.wording import Table

if TYPE_CHECKING:
    from rigidpend.experiments.data import Loaded


@click.command("bench")
@click.option(
    "--quick",
    is_flag=True,
    help="Small version, under a minute, to try it: its times are not measurements.",
)
@OUT
@JSON
@SETTINGS
@click.option("--force", is_flag=True, help="Measure even if the result is up to date.")
def bench_command(
    quick: bool, folder: Path, as_json: bool, settings: tuple[str, ...], force: bool
) -> None:
    """Measure the times and errors of our methods and of others, on this machine.

    Writes FOLDER/bench.h5 and bench.png and prints the tables. An interrupted run continues
    when called again.

    \b
    Examples:
      rigidpend bench --quick
      rigidpend bench --set meeting.rounds=31 --json
    """
    from rigidpend.experiments.bench import report

    # One at a time, because anything that runs beside a timing disturbs it.
    result = measured("bench", quick, settings, folder, force=force, jobs=1)
    _tell(result, report.tables(result), as_json)


@click.command("stress")
@click.option("--quick", is_flag=True, help="Small version of every kind of trial; takes a minute.")
@OUT
@JSON
@SETTINGS
@JOBS
@click.option("--force", is_flag=True, help="Run even if the result is up to date.")
def stress_command(
    quick: bool, folder: Path, as_json: bool, settings: tuple[str, ...], jobs: int, force: bool
) -> None:
    """Test long times, extreme bodies, symmetries, and whether symbols called certain are right.

    Writes FOLDER/stress.h5 and stress.png and prints the margin of each claim. Exit code 1: a
    claim failed. An interrupted run continues when called again.

    \b
    Examples:
      rigidpend stress --quick
      rigidpend stress --set problem.honesty.orbits=1000000 --json
    """
    from rigidpend.experiments.stress import REFUTED, draw

    result = measured("stress", quick, settings, folder, force=force, jobs=jobs)
    _tell(result, [*draw.claims_tables(result), *draw.tables(result)], as_json)
    refuted = any(REFUTED in group["claims"]["verdict"] for group in result["data"].values())
    sys.exit(FAILED if refuted else DONE)


def measured(
    name: str, quick: bool, settings: Sequence[str], folder: Path, *, force: bool, jobs: int
) -> Loaded:
    """Run a measurement unless it is up to date, draw it, and return the result."""
    from rigidpend import render
    from rigidpend.results import store
    from rigidpend.runs import loading, runner

    [path] = resolve((f"{name}_quick" if quick else name,))
    planned = runner.plan(loading.load(path, settings), folder, force=force)
    tell = partial(say, of=planned.config.name)
    if planned.reason:
        runner.follow(planned, jobs, tell)
    else:
        tell(f"{planned.target} is up to date")
    picture = planned.target.with_suffix(".png")
    render.render(planned.target, picture)
    tell(f"{picture} drawn")
    return store.load(planned.target)


def _tell(result: Loaded, tables: Sequence[Table], as_json: bool) -> None:
    """Print measurements with their machine, as tables or as data."""
    machine = result["provenance"]
    if as_json:
        print_json({"machine": machine, "data": result["data"]})
        return
    click.echo(f"{machine['processor']}, {machine['system']}; {machine['created']}\n")
    for line in (line for table in tables for line in wording.terminal(table)):
        click.echo(line)
