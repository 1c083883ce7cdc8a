"""`rigidpend stress`: trials at the limits, each with a bound declared before."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from rigidpend.cli.common import (
    DONE,
    FAILED,
    JOBS,
    JSON,
    OUT,
    SETTINGS,
    guarded,
    measured,
    print_json,
)


@click.command("stress")
@click.option("--quick", is_flag=True, help="Small version of every kind of trial: a minute.")
@OUT
@JSON
@SETTINGS
@JOBS
@click.option("--force", is_flag=True, help="Run even what is up to date.")
@guarded
def command(
    quick: bool,
    folder: Path,
    as_json: bool,
    settings: tuple[str, ...],
    jobs: int,
    force: bool,
) -> None:
    """Test long times, extreme bodies, symmetries, and whether certain symbols are true.

    Writes FOLDER/stress.h5 and stress.png and prints by how much each claim passes. Ends with 1
    where one fails. An interrupted run goes on where it was.

    \b
    Examples:
      rigidpend stress --quick
      rigidpend stress --set problem.honesty.orbits=1000000 --json
    """
    from rigidpend.experiments.stress import report
    from rigidpend.results import store

    target = measured("stress", quick, settings, folder, force=force, jobs=jobs)
    machine, data = store.load(target)["provenance"], store.read_tree(target)
    if as_json:
        print_json({"machine": machine, **report.summary(data)})
    else:
        click.echo(f"{machine['processor']}, {machine['system']}; {machine['created']}")
        click.echo("\n".join(report.text(data)))
    sys.exit(FAILED if report.counts(data)["FAILED"] else DONE)
