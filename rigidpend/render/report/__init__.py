"""One self-contained HTML page from a folder of results: figures beside numbers.

An experiment's ``report.py`` says what stands beside its figure: ``tables(result)``
gives the numbers that the paper prints next to those computed, from the stored result alone.
Experiments without such a module appear with their figure and provenance.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rigidpend import experiments
from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine import files, words
from rigidpend.machine.files import Absent
from rigidpend.machine.tables import Table
from rigidpend.machine.workers import check_stop
from rigidpend.render.report.departures import DEPARTURES
from rigidpend.render.report.page import ResultSection, html, picture, problem
from rigidpend.results import store
from rigidpend.runs import remedies
from rigidpend.runs.certificate_files import beside, marked, results_in

__all__ = ["build", "write"]


class Page(NamedTuple):
    """A page as HTML, and what is wrong with results that it cannot show."""

    html: str
    problems: list[str]


def results(folder: Path) -> list[Path]:
    """Result files directly in a folder, by name; certificates are not.

    Raises
    ------
    Absent
        There is none.
    """
    found = results_in(folder)
    if not found:
        raise Absent(f"{folder}: no results; call: rigidpend run all --out {folder}")
    return found


def write(sources: Sequence[Path], target: Path) -> list[str]:
    """Write the page for some results, whole or not at all.

    Returns
    -------
    list of str
        What is wrong with results that it cannot show; the page says it too.

    Raises
    ------
    StoreError
        As :func:`build`; or the page cannot be written.
    """
    page = build(sources)
    files.prepare(target)
    files.write(target, page.html.encode("utf-8"))
    return page.problems


def build(sources: Sequence[Path]) -> Page:
    """Build the page for some results.

    Raises
    ------
    StoreError
        None of them can be shown; Absent where none is there.
    """
    sections = [_section(source) for source in sources]
    problems = [said for found in sections if (said := found.problem or found.doubt)]
    # A page of nothing but complaints is no report.
    if all(found.problem for found in sections):
        there = any(source.exists() for source in sources)
        raise (store.StoreError if there else Absent)("\n".join(problems))
    page = html(sorted(sections, key=lambda found: found.order), DEPARTURES)
    return Page(page, problems)


def _section(source: Path) -> ResultSection:
    """The part of a file; a sentence where it cannot be shown."""
    from rigidpend import render
    from rigidpend.render import OF_VALUES, Undrawable

    check_stop()
    try:
        result = store.load(source)
        certificate, doubt = _certificate(source)
        drawn = render.kept(source.with_suffix(".png"), render.drawn_from([source]))
        return section(marked(result, certificate), drawn)._replace(doubt=doubt)
    except Undrawable as error:
        return problem(source.stem, remedies.told(Undrawable.of(source, str(error))))
    except store.StoreError as error:
        return problem(source.stem, remedies.told(error))
    except MemoryError:
        return problem(source.stem, f"{source}: not enough memory to show it")
    except OF_VALUES as error:
        # One file, whatever is in it, does not keep the others from being shown.
        return problem(source.stem, f"{source}: cannot be shown: {words.error(error)}")


def _certificate(source: Path) -> tuple[Loaded | None, str]:
    """The certificate beside a result; failing that, why none of it is shown."""
    try:
        return beside(source), ""
    except store.StoreError as error:
        return None, f"nothing is marked as proven: {remedies.told(error)}"


def section(result: Any, drawn: bytes | None = None) -> ResultSection:
    """Make a result's part of the page, with its image, drawn now where none is given."""
    from rigidpend import render
    from rigidpend.render import captions

    attributes = result["attributes"]
    experiment = str(attributes["experiment"])
    return ResultSection(
        name=str(attributes.get("name", "unnamed")),
        figure=str(attributes.get("figure", "")),
        experiment=experiment,
        picture=picture(drawn or render.image([result], "png")),
        caption=captions.caption(experiment),
        bodies=captions.bodies(result),
        tables=_tables(experiment, result),
        provenance=_provenance(result),
    )


def _tables(experiment: str, result: Any) -> Sequence[Table]:
    from rigidpend import render

    reporting = experiments.reporting(experiment)
    try:
        return reporting.tables(result) if reporting else []
    except render.OF_VALUES as error:
        # As with drawing: a file may hold any values.
        raise render.Undrawable(f"cannot be shown: {words.error(error)}") from error


def _provenance(result: Any) -> list[tuple[str, str]]:
    """Provenance of a result, for the foot of its part."""
    fingerprint = ("engine", "config_hash", "code_hash")
    rows = [(key, str(result["attributes"].get(key, ""))) for key in fingerprint]
    rows += [(key, str(value)) for key, value in result["provenance"].items()]
    return [(key.replace("_", " "), value) for key, value in rows]
