"""`rigidpend bench`: speed, error and trust beside other methods."""

from __future__ import annotations

from pathlib import Path

import click

from rigidpend.cli.common import JSON, OUT, SETTINGS, guarded, print_json, say


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
    from rigidpend import render, tables
    from rigidpend.config import loading
    from rigidpend.config.names import resolve
    from rigidpend.measure.benchmark import reading
    from rigidpend.results import store
    from rigidpend.run import runner

    [path] = resolve(("bench_quick" if quick else "bench",))
    planned = runner.plan(loading.load(path, settings), folder, force=force)
    if planned.reason:
        # One at a time: whatever runs beside a timing disturbs it.
        runner.follow(planned, jobs=1, say=say)
    else:
        say(f"{planned.config.name}: {planned.target} is up to date")
    picture = planned.target.with_suffix(".png")
    render.render(planned.target, picture)
    say(f"{planned.config.name}: {picture} drawn")
    result = store.load(planned.target)
    if as_json:
        found = {"machine": result["provenance"], **reading.summary(result["data"])}
        print_json(found)
        return
    machine = result["provenance"]
    click.echo(f"{machine['processor']}, {machine['system']}; {machine['created']}\n")
    for table in reading.tables(result["data"]):
        for line in tables.terminal(table):
            click.echo(line)
