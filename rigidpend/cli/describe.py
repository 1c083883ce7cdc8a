"""`rigidpend describe`: what a config asks for."""

from __future__ import annotations

import click

from rigidpend.cli.common import SETTINGS, guarded


@click.command("describe")
@click.argument("name", metavar="NAME|FILE.yaml")
@SETTINGS
@guarded
def command(name: str, settings: tuple[str, ...]) -> None:
    """Print a config's parameters with units, and what follows from them.

    \b
    Example:
      rigidpend describe fig4 --set problem.mu=0.01
    """
    from rigidpend import config, experiments

    for path in config.names.resolve((name,)):
        loaded = config.load(path, settings)
        click.echo(f"{loaded.name}: experiment {loaded.experiment}, {path}")
        rows = experiments.module(loaded.experiment).describe(loaded.content)
        name_width = max(len(row.name) for row in rows)
        value_width = max(len(row.value) for row in rows)
        for row in rows:
            click.echo(f"  {row.name:<{name_width}}  {row.value:<{value_width}}  {row.meaning}")
