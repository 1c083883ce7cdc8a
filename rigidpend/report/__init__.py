"""One self-contained HTML page from a folder of results: figures beside numbers.

A module here, named as an experiment, says what stands beside its figure: ``tables(result)``
gives the numbers that the paper prints next to those computed, from the stored result alone.
Experiments without such a module appear with their figure and provenance.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rigidpend import experiments
from rigidpend.departures import DEPARTURES
from rigidpend.report.page import ResultSection, html, picture
from rigidpend.results import store

__all__ = ["build", "write"]


def write(folder: Path, target: Path) -> None:
    """Write the page for all results in a folder, whole or not at all.

    Raises
    ------
    StoreError
        As :func:`build`; or the page cannot be written.
    """
    page = build(folder)
    store.prepare(target)
    store.replace(target, page.encode("utf-8"))


def build(folder: Path) -> str:
    """Build the page for all results in a folder, as HTML.

    Parameters
    ----------
    folder : Path
        Every ``*.h5`` directly in it that is a result of ours is reported, by name.

    Raises
    ------
    StoreError
        There is no result in it, or one that cannot be read.
    """
    sources = sorted(folder.glob("*.h5"))
    if not sources:
        raise store.StoreError(f"{folder}: no results; call: rigidpend run all --out {folder}")
    sections = [section(store.load(source)) for source in sources]
    return html(sorted(sections, key=lambda found: found.order), DEPARTURES)


def section(result: Any) -> ResultSection:
    """Make a result's part of the page."""
    from rigidpend import render

    attributes = result["attributes"]
    experiment = str(attributes["experiment"])
    reporting = experiments.reporting(experiment)
    return ResultSection(
        name=str(attributes["name"]),
        figure=str(attributes["figure"]),
        experiment=experiment,
        picture=picture(render.image(result, "png")),
        tables=reporting.tables(result) if reporting else [],
        provenance=_provenance(result),
    )


def _provenance(result: Any) -> list[tuple[str, str]]:
    """Provenance of a result, for the foot of its part."""
    fingerprint = ("engine", "config_hash", "code_hash")
    rows = [(key, str(result["attributes"].get(key, ""))) for key in fingerprint]
    rows += [(key, str(value)) for key, value in result["provenance"].items()]
    return [(key.replace("_", " "), value) for key, value in rows]
