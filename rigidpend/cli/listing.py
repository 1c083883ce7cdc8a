"""`rigidpend list`: the configs that can be named, with the state of their results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from rigidpend.cli.common import INTERNAL, JSON, OUT, exit_code, guarded, print_json, print_table


@click.command("list")
@OUT
@JSON
@guarded
def command(folder: Path, as_json: bool) -> None:
    """List the configs that can be named, with the state of their results.

    Experiment, file of the config, status of the result.

    What a config in configs/measure/ measures depends on this machine and takes minutes: it is
    run by its name, not by all.

    \b
    Examples:
      rigidpend list
      rigidpend list --json
    """
    from rigidpend.config import catalogue

    entries = [_entry(name, path, folder) for name, path in catalogue.known().items()]
    if as_json:
        print_json(entries)
    elif entries:
        print_table([_row(entry) for entry in entries])


def _entry(name: str, path: Path, folder: Path) -> dict[str, Any]:
    from rigidpend.config import catalogue, loading
    from rigidpend.run import runner

    entry: dict[str, Any] = {"name": name, "experiment": None, "status": "cannot be used"}
    entry |= {"reason": None, "in_all": catalogue.in_all(path), "config": str(path), "file": None}
    try:
        loaded = loading.load(path)
        entry["experiment"] = loaded.experiment
        planned = runner.plan(loaded, folder)
    except Exception as error:
        # One bad config or damaged result does not hide the others.
        if exit_code(error) == INTERNAL:
            raise
        return entry | {"reason": str(error)}
    entry["status"] = "to run" if planned.reason else "up to date"
    return entry | {"reason": planned.reason or None, "file": str(planned.target)}


def _row(entry: dict[str, Any]) -> list[str]:
    status, reason = entry["status"], entry["reason"]
    # Of a config with many faults the first line; `describe` has them all.
    said = f"{status}: {reason.splitlines()[0]}" if reason else status
    by_name = "" if entry["in_all"] else " (by name only)"
    return [entry["name"], entry["experiment"] or "-", entry["config"], f"{said}{by_name}"]
