"""`rigidpend list`: the configs that can be named."""

from __future__ import annotations

import click

from rigidpend.cli.common import guarded, say


@click.command("list")
@guarded
def command() -> None:
    """List the configs that can be named."""
    from rigidpend import config

    for name, path in config.names.known().items():
        try:
            click.echo(f"{name}\t{config.load(path).experiment}\t{path}")
        except config.ConfigError as error:
            click.echo(f"{name}\tcannot be used\t{path}")
            say(str(error))
