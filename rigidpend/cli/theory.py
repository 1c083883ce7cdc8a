"""`rigidpend theory`: the theory's values for a config's body, before anything is computed."""

from __future__ import annotations

import click

from rigidpend.cli import complete
from rigidpend.cli.common import (
    JSON,
    NAMED,
    SETTINGS,
    guarded,
    print_json,
    print_rows,
    row_document,
    the_one,
)


@click.command("theory")
@click.argument("name", default="fig4", metavar=f"[{NAMED}]", shell_complete=complete.names)
@SETTINGS
@JSON
@guarded
def command(name: str, settings: tuple[str, ...], as_json: bool) -> None:
    """Print the theory's values for the body of a config.

    Angles, Melnikov's zeros, increments of theta3, multipliers of the periodic orbits.

    NAME is a config with one body and an energy constant h0; fig4 if not given.

    \b
    Examples:
      rigidpend theory
      rigidpend theory fig5 --json
      rigidpend theory --set problem.mu=0.01 --set problem.h0=10/9
    """
    from rigidpend.config.theory import of
    from rigidpend.runs import loading

    path = the_one(name, "theory")
    rows = of(loading.load(path, settings).content.problem)
    if not rows:
        raise click.UsageError(f"{path} has not one body and one h0, as fig4 and fig5 have")
    if as_json:
        print_json([row_document(row) for row in rows])
    else:
        print_rows(rows)
