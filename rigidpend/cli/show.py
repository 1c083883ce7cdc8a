"""`rigidpend list`, `describe`: configs, and what follows from them without computing."""

import itertools
from pathlib import Path
from typing import Any

import click

from rigidpend import experiments
from rigidpend.cli.common import INTERNAL, exit_code, folder_of, print_json, print_table, sentence
from rigidpend.cli.options import JSON, NAMED, OUT, SETTINGS, complete_names
from rigidpend.config import catalogue


@click.command("list")
@OUT
@JSON
def list_command(folder: Path, as_json: bool) -> None:
    """List the configs that can be named, with the state of their results.

    Each line has name, experiment, status of the result and the count of uncertain symbols,
    grouped by the folder of the config. Results without a config come last: they can be named too.

    Configs in configs/measure/ measure this machine for minutes. They are run by name only, and
    not by all, as are configs in the current folder, and results.

    \b
    Examples:
      rigidpend list
      rigidpend list --json
    """
    entries = [_entry(*named, folder) for named in _named(folder)]
    if as_json:
        print_json(entries)
        return
    for place, group in itertools.groupby(entries, lambda entry: entry["config"].parent):
        rows = [_row(entry) for entry in group]
        click.echo(f"{place}/" if str(place) != "." else "here")
        print_table(rows, "  ")


def _named(folder: Path) -> list[tuple[str, Path]]:
    """Names with their files: known configs, those in the current folder, then results."""
    from rigidpend.runs.certificate_files import results_in

    by_name = {**catalogue.known(), **catalogue.own()}
    # Folders of configs that `all` includes first, then configs that are run by name only.
    files = sorted(by_name.values(), key=lambda path: not catalogue.in_all(path))
    places = list(dict.fromkeys(path.parent for path in files))
    stray = ((path.stem, path) for path in results_in(folder) if path.stem not in by_name)
    return [*sorted(by_name.items(), key=lambda each: places.index(each[1].parent)), *stray]


def _entry(name: str, path: Path, folder: Path) -> dict[str, Any]:
    """The entry of a config or result; an error in it must not hide the other entries."""
    from rigidpend.runs import loading, runner

    told: dict[str, Any] = {"name": name, "experiment": None}
    place, file = folder_of(path, folder), None
    try:
        config = loading.load(path)
        told["experiment"] = config.content.experiment
        found = runner.plan(config, place)
        told["status"] = "to run" if found.reason else "up to date"
        told |= {"reason": found.reason or None, "doubt": found.doubt or None}
        file = found.target
    except Exception as error:
        if exit_code(error) == INTERNAL:
            raise
        # Python's own text of a system's refusal begins with a number.
        said = sentence(error) if isinstance(error, OSError) else str(error)
        told |= {"status": "cannot be used", "reason": said, "doubt": None}
    return told | {"in_all": catalogue.in_all(path), "config": path, "file": file}


def _row(entry: dict[str, Any]) -> list[str]:
    status, reason = entry["status"], entry["reason"]
    # Only the first line of many complaints about a config; `describe` shows all of them.
    said = f"{status}: {reason.splitlines()[0]}" if reason else status
    doubt = f"; {entry['doubt']}" if entry["doubt"] else ""
    by_name = " (by name only)" if entry["config"].parent.name == catalogue.MEASURE else ""
    return [entry["name"], entry["experiment"] or "-", f"{said}{doubt}{by_name}"]


@click.command("describe")
@click.argument("name", metavar=NAMED, shell_complete=complete_names)
@SETTINGS
@click.option("--resolved", is_flag=True, help="Print the whole config as YAML, defaults included.")
@JSON
def describe_command(name: str, settings: tuple[str, ...], resolved: bool, as_json: bool) -> None:
    """Print the parameters of a config, and what follows from them by the paper's theory.

    With --resolved it prints the config itself, with every default and every setting in its
    place: a file that gives the same result. NAME may be all, but not with --resolved.

    \b
    Examples:
      rigidpend describe fig4 --set problem.mu=0.01
      rigidpend describe fig4 --resolved > mine.yaml
      rigidpend describe all --json
    """
    from rigidpend.runs import loading

    paths = catalogue.resolve((name,))
    if resolved and len(paths) > 1:
        raise click.UsageError("--resolved prints one config, not all")
    loaded = [found for [found] in loading.load_swept(paths, settings)]
    if as_json:
        print_json([_document(each) for each in loaded])
    elif resolved:
        click.echo(loading.resolved_yaml(loaded[0]), nl=False)
    else:
        for path, each in zip(paths, loaded, strict=True):
            if path != paths[0]:
                click.echo()
            click.echo(f"{each.name}: experiment {each.content.experiment}, {path}")
            rows = experiments.describe(each.content)
            print_table([row[:3] for row in rows], "  ")


def _document(loaded: Any) -> dict[str, Any]:
    rows = experiments.describe(loaded.content)
    return {
        "name": loaded.name,
        "experiment": loaded.content.experiment,
        "config_hash": loaded.config_hash,
        "config": loaded.resolved(),
        "rows": [row._asdict() for row in rows],
    }
