"""`rigidpend describe`: a config's parameters, and the theory's values for its body."""

from __future__ import annotations

from typing import Any

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
)


@click.command("describe")
@click.argument("name", metavar=NAMED, shell_complete=complete.names)
@SETTINGS
@click.option("--resolved", is_flag=True, help="Print the whole config as YAML, defaults included.")
@JSON
@guarded
def command(name: str, settings: tuple[str, ...], resolved: bool, as_json: bool) -> None:
    """Print the parameters of a config, and what follows from them by the paper's theory.

    With --resolved it is the config itself, every default and every setting in its place: a
    file that gives the same result. NAME may be all, but not with --resolved.

    \b
    Examples:
      rigidpend describe fig4 --set problem.mu=0.01
      rigidpend describe fig4 --resolved > mine.yaml
      rigidpend describe all --json
    """
    from rigidpend.config.catalogue import resolve
    from rigidpend.runs import loading

    paths = resolve((name,))
    if resolved and len(paths) > 1:
        raise click.UsageError("--resolved prints one config, not all")
    loaded = loading.load_all(paths, settings)
    if as_json:
        print_json([_document(each) for each in loaded])
    elif resolved:
        click.echo(loading.resolved_yaml(loaded[0]), nl=False)
    else:
        for path, each in zip(paths, loaded, strict=True):
            if path != paths[0]:
                click.echo()
            click.echo(f"{each.name}: experiment {each.experiment}, {path}")
            print_rows(_rows(each), "  ")


def _rows(loaded: Any) -> list[Any]:
    from rigidpend import experiments

    return experiments.describe(loaded.experiment, loaded.content)


def _document(loaded: Any) -> dict[str, Any]:
    return {
        "name": loaded.name,
        "experiment": loaded.experiment,
        "config_hash": loaded.config_hash,
        "config": loaded.resolved(),
        "rows": [row_document(row) for row in _rows(loaded)],
    }
