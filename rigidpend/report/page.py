"""Page of the report: its parts as plain records, and their HTML."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rigidpend import tables
from rigidpend.tables import Table

HERE = Path(__file__).parent


class ResultSection(NamedTuple):
    """A result's part of the page."""

    name: str
    figure: str
    experiment: str
    picture: str
    """Image as a data URI."""
    tables: Sequence[Table]
    provenance: Sequence[tuple[str, str]]
    problem: str = ""
    """Reason why nothing is shown."""

    @property
    def title(self) -> str:
        if self.problem:
            return self.name
        what = self.experiment.replace("_", " ")
        return f"Fig. {self.figure}: {what}" if self.of_the_paper else what.capitalize()

    @property
    def of_the_paper(self) -> bool:
        """True if the paper has this figure: its number begins with a digit."""
        return self.figure[:1].isdigit()

    @property
    def order(self) -> tuple[bool, str]:
        """Sorting key: the paper's figures first, in their order."""
        return not self.of_the_paper, f"{self.figure} {self.name}"


def problem(name: str, said: str) -> ResultSection:
    """Make the part of a result that cannot be shown: a sentence."""
    return ResultSection(name, "", "", "", (), (), said)


def picture(png: bytes) -> str:
    """Encode an image as a data URI, so that the page needs no other file."""
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"


def html(sections: Sequence[ResultSection], departures: Sequence[Any]) -> str:
    """Write the whole page as HTML.

    Parameters
    ----------
    sections : sequence of ResultSection
    departures : sequence of Departure
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["sheet"] = tables.html
    style = (HERE / "page.css").read_text(encoding="utf-8")
    template = environment.get_template("page.html")
    slips = Table(
        "Where the paper slips, or leaves a value open, and what is computed here",
        ("place", "as printed", "here"),
        [departure.row for departure in departures],
    )
    return template.render(sections=sections, departures=slips, style=style)
