"""`rigidpend verify`: compare stored results with fresh ones."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from rigidpend.cli import complete
from rigidpend.cli.common import (
    DONE,
    FAILED,
    INTERNAL,
    JOBS,
    JSON,
    exit_code,
    guarded,
    print_json,
    say,
)


@click.command("verify")
@click.argument("names", nargs=-1, metavar="[NAME|FILE.yaml|all]...", shell_complete=complete.names)
@click.option(
    "--reference",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results/reference"),
    show_default=True,
    help="Folder of the stored results.",
)
@click.option(
    "--results",
    type=click.Path(file_okay=False, path_type=Path),
    help="Read the results to be compared in this folder, rather than compute them.",
)
@JSON
@JOBS
@guarded
def command(
    names: tuple[str, ...],
    reference: Path,
    results: Path | None,
    as_json: bool,
    jobs: int | None,
) -> None:
    """Compute experiments again, all if none is named, and compare with stored results.

    Values are compared, not bytes: symbols and texts exactly where they are certain, numbers
    to what their experiment's arithmetic explains, and also what the files consist of, but not
    where and when they were made. Symbols that a certificate beside the compared result proves
    must be as proven. The exit code is 1 where something differs.

    \b
    Examples:
      rigidpend verify
      rigidpend verify fig4 --reference old/results
      rigidpend verify all --results results --json
    """
    from rigidpend.config.names import resolve

    everything = not names or "all" in names
    paths = resolve(names or ("all",))
    found = []
    for path in paths:
        found.append(_compared(path, reference, results, jobs))
        if not as_json:
            _tell(found[-1])
    strays = _strays(reference, {path.stem for path in paths}) if everything else []
    same = not strays and all(one["same"] for one in found)
    if as_json:
        print_json({"same": same, "results": found, "without_config": strays})
    for stray in strays:
        say(f"rigidpend: {stray}: no config has this name")
    sys.exit(DONE if same else FAILED)


def _compared(path: Path, reference: Path, results: Path | None, jobs: int | None) -> Any:
    """Compute one experiment and compare it, as plain data."""
    from rigidpend.certified import storage
    from rigidpend.config import loading
    from rigidpend.results import regression, store, words
    from rigidpend.run import workers

    loaded = loading.load(path)
    stored = reference / f"{loaded.name}.h5"
    read = results / stored.name if results else None
    outcome: dict[str, Any] = {"name": loaded.name, "reference": str(stored), "same": False}
    try:
        proof = storage.beside(read or stored)
        found = regression.verify(
            loaded, stored, jobs=jobs or workers.cores(), fresh=read, certificate=proof
        )
    except store.StoreError as error:
        return {**outcome, "error": str(error), "differences": []}
    except (LookupError, TypeError, ValueError, ZeroDivisionError) as error:
        if exit_code(error) != INTERNAL:
            raise
        # A file may hold any values: what a comparison makes of them cannot be foreseen.
        said = f"{stored}: cannot be compared: {words.error(error)}"
        return {**outcome, "error": said, "differences": []}
    listed = [_parts(difference) for difference in found]
    proven = sum(int(each["proven"].sum()) for each in proof["data"].values()) if proof else 0
    told = {"same": not found, "error": None, "differences": listed, "proven": proven}
    return {**outcome, **told}


def _parts(difference: Any) -> dict[str, Any]:
    """Convert a difference to plain data; values that JSON does not know become words."""
    from rigidpend.results.compare import shown

    told = {"said": str(difference)}
    if hasattr(difference, "place"):
        values = {"stored": difference.stored, "computed": difference.computed}
        told |= {"place": difference.place, **{k: shown(x) for k, x in values.items()}}
        told["allowed"] = difference.allowed
    return told


def _tell(outcome: dict[str, Any]) -> None:
    if outcome["error"]:
        say(f"rigidpend: {outcome['error']}")
        return
    verdict = "the same as in" if outcome["same"] else "differs from"
    proven = f"; {outcome['proven']} symbols are proven" if outcome["proven"] else ""
    click.echo(f"{outcome['name']}: {verdict} {outcome['reference']}{proven}")
    for difference in outcome["differences"]:
        click.echo(f"  {difference['said']}")


def _strays(reference: Path, names: set[str]) -> list[str]:
    """Names of stored results that belong to no config."""
    from rigidpend.certified.storage import is_certificate

    stored = sorted(file for file in reference.glob("*.h5") if not is_certificate(file))
    return [str(file) for file in stored if file.stem not in names]
