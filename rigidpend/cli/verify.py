"""`rigidpend verify`, `reference`: stored results compared with fresh ones, and renewed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rigidpend.cli.common import ABSENT, DONE, FAILED, print_json, say
from rigidpend.cli.options import FOLDER, JOBS, JSON, NAMED, SETTINGS, complete_names
from rigidpend.config import catalogue
from rigidpend.config.catalogue import PACKAGE, REFERENCES, resolve
from rigidpend.machine.progress import Progress

if TYPE_CHECKING:
    from rigidpend.experiments.compare import Difference


@click.command("verify")
@click.argument("names", nargs=-1, metavar=f"[{NAMED}|all]...", shell_complete=complete_names)
@click.option(
    "--reference",
    type=FOLDER,
    help="Folder of the stored results. If not given: results/reference, or the package's for"
    " references missing there.",
)
@click.option(
    "--results",
    type=FOLDER,
    help="Compare the results in this folder, rather than compute them.",
)
@SETTINGS
@JSON
@JOBS
def verify_command(
    names: tuple[str, ...],
    reference: Path | None,
    results: Path | None,
    settings: tuple[str, ...],
    as_json: bool,
    jobs: int,
) -> None:
    """Compute experiments again, all if none is named, and compare with stored results.

    Values are compared, not bytes: certain symbols and texts exactly, numbers within the bounds
    that their experiment declares, and also the structure of the files, but not where and when
    they were made. Symbols must agree with a certificate beside the compared result. Exit code 1:
    something differs; 3: there is nothing to compare with.

    With --set other numerics are compared with the stored result, such as another engine. To
    compare two results of your own problem, give the file of one and the folder of the other.

    \b
    Examples:
      rigidpend verify
      rigidpend verify fig4 --reference old/results
      rigidpend verify all --results results --json
      rigidpend verify fig4 --set numerics.engine=scipy
      rigidpend verify results/fig4.h5 --results old/results
    """
    from rigidpend.machine.workers import check_stop
    from rigidpend.runs.certificate_files import results_in

    if settings and results:
        raise click.UsageError("--set changes what is computed, and --results computes nothing")
    everything = not names or "all" in names
    paths = resolve(names or ("all",))
    folders = [reference] if reference else folders_of_references()
    found = []
    with Progress(len(paths), patient=True) as display:
        for path in paths:
            check_stop()
            hear = partial(display.hear, path.stem)
            found.append(_compared(path, settings, folders, results, jobs, hear))
            display.end(path.stem, well=False)
            display.clear()
            if not as_json:
                _tell(found[-1])
    # If everything is compared, a reference without a config is a difference too.
    known = {path.stem for path in paths}
    strays = [x for x in results_in(folders[0]) if everything and x.stem not in known]
    same = not strays and all(one["same"] for one in found)
    if as_json:
        print_json({"same": same, "results": found, "without_config": strays})
    for stray in strays:
        say(f"rigidpend: {stray}: no config has this name")
    absent = any(one["absent"] for one in found)
    sys.exit(ABSENT if absent else DONE if same else FAILED)


def folders_of_references() -> list[Path]:
    """Folders of the references: here, in the checkout, and installed with the package."""
    known = (REFERENCES, PACKAGE.parent / REFERENCES, PACKAGE / "reference")
    # The first is always listed: it is where new references would be made.
    return [folder for folder in known if folder == REFERENCES or folder.is_dir()]


def _compared(
    path: Path,
    settings: tuple[str, ...],
    folders: Sequence[Path],
    results: Path | None,
    jobs: int,
    hear: Callable[[str], None],
) -> Any:
    """Compute one experiment and compare it, as plain data."""
    from rigidpend.machine import files
    from rigidpend.runs import certificate_files as storage
    from rigidpend.runs import loading, references

    loaded = loading.load(path, settings)
    # The first folder that has the reference counts, or the first folder if none has it.
    places = [path] if path.suffix == ".h5" else [each / f"{loaded.name}.h5" for each in folders]
    stored = next(filter(Path.exists, places), places[0])
    read = results / stored.name if results else None
    outcome: dict[str, Any] = {"name": loaded.name, "reference": stored, "same": False}
    outcome |= {"absent": False, "error": None, "differences": []}
    try:
        # The certificate beside the result that is read, or else that beside the reference.
        proof = storage.beside(read or stored)
        given: Any = {"jobs": jobs, "report": hear}
        found = references.verify(loaded, stored, fresh=read, certificate=proof, **given)
    except files.StoreError as error:
        absent = isinstance(error, files.Absent)
        said = f"{error}; {catalogue.remedy_of_reference(path, stored)}"
        if error.file != stored or path == stored:
            said = catalogue.with_remedy(error)
        return {**outcome, "absent": absent, "error": said}
    return outcome | {
        "same": not found,
        "differences": [_parts(x) for x in found],
        "proven": storage.count(proof) if proof else 0,
    }


def _parts(difference: Difference) -> dict[str, Any]:
    """Convert a difference to plain data; values that JSON does not know become text."""
    from rigidpend.experiments.compare import shown

    return {
        "said": str(difference),
        "place": difference.place,
        "stored": shown(difference.stored),
        "computed": shown(difference.computed),
        "allowed": difference.allowed,
    }


def _tell(outcome: dict[str, Any]) -> None:
    if outcome["error"]:
        say(f"rigidpend: {outcome['error']}")
        return
    verdict = "the same as in" if outcome["same"] else "differs from"
    proven = f"; {outcome['proven']} symbols are proven" if outcome["proven"] else ""
    click.echo(f"{outcome['name']}: {verdict} {outcome['reference']}{proven}")
    for difference in outcome["differences"]:
        click.echo(f"  {difference['said']}")


@click.command("reference")
@click.argument("names", nargs=-1, metavar=f"[{NAMED}|all]...", shell_complete=complete_names)
@click.option(
    "--reason", default="", help="Reason for the renewal; the file keeps it, after earlier ones."
)
@click.option(
    "--reference",
    "folder",
    type=FOLDER,
    default=REFERENCES,
    show_default=True,
    help="Folder of the references.",
)
@JOBS
def reference_command(names: tuple[str, ...], reason: str, folder: Path, jobs: int) -> None:
    """Compute references again, all if none is named, and keep the reason in each file.

    \b
    Example:
      rigidpend reference fig4 --reason "n_symbols = 20"
    """
    from rigidpend.runs import loading, references

    # Checked here, and not by `required` of the option, because blanks are no reason either.
    if not reason.strip():
        raise click.UsageError("a reference is renewed for a reason: give it with --reason")
    paths = resolve(names or ("all",))
    for path in paths:
        loaded = loading.load(path)
        target = folder / f"{loaded.name}.h5"
        references.renew(loaded, target, reason, jobs=jobs)
        say(f"{loaded.name}: {target} renewed")
