"""`rigidpend bench`: speed, error and trust beside other methods."""

from __future__ import annotations

from pathlib import Path

import click

from rigidpend.cli.common import JSON, OUT, SETTINGS, guarded, measured, print_json


@click.command("bench")
@click.option(
    "--quick", is_flag=True, help="Small version, under a minute: a trial run, no timing."
)
@OUT
@JSON
@SETTINGS
@click.option("--force", is_flag=True, help="Measure even what is up to date.")
@guarded
def command(
    quick: bool, folder: Path, as_json: bool, settings: tuple[str, ...], force: bool
) -> None:
    """Measure our methods and others, on this machine, with one thread and with two.

    Writes FOLDER/bench.h5 and bench.png and prints the tables. An interrupted run goes on
    where it was.

    \b
    Examples:
      rigidpend bench --quick
      rigidpend bench --set search.seconds=1 --json
    """
    from rigidpend.experiments.bench import report
    from rigidpend.machine import tables
    from rigidpend.results import store

    # One at a time: whatever runs beside a timing disturbs it.
    result = store.load(measured("bench", quick, settings, folder, force=force, jobs=1))
    machine = result["provenance"]
    if as_json:
        print_json({"machine": machine, **report.summary(result["data"])})
        return
    click.echo(f"{machine['processor']}, {machine['system']}; {machine['created']}\n")
    for table in report.tables(result):
        for line in tables.terminal(table):
            click.echo(line)
