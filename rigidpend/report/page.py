"""The page: its parts as plain records, and how they become HTML."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).parent


class Table(NamedTuple):
    """Rows of text under a caption."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


class Section(NamedTuple):
    """A result's part of the page."""

    name: str
    figure: str
    experiment: str
    picture: str
    """A data URI."""
    tables: Sequence[Table]
    provenance: Sequence[tuple[str, str]]
    problem: str = ""
    """Why nothing is shown."""

    @property
    def title(self) -> str:
        if self.problem:
            return self.name
        what = self.experiment.replace("_", " ")
        return f"Fig. {self.figure}: {what}" if self.of_the_paper else what.capitalize()

    @property
    def of_the_paper(self) -> bool:
        """Whether the paper has this figure: its number begins with a digit."""
        return self.figure[:1].isdigit()

    @property
    def order(self) -> tuple[bool, str]:
        """The paper's figures first, in their order."""
        return not self.of_the_paper, f"{self.figure} {self.name}"


def problem(name: str, said: str) -> Section:
    """The part of a result that cannot be shown."""
    return Section(name, "", "", "", (), (), said)


def picture(png: bytes) -> str:
    """An image as a data URI, so that the page needs no other file."""
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"


def html(sections: Sequence[Section], departures: Sequence[Any]) -> str:
    """The whole page.

    Parameters
    ----------
    sections : sequence of Section
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
    style = (HERE / "page.css").read_text(encoding="utf-8")
    template = environment.get_template("page.html")
    return template.render(sections=sections, departures=departures, style=style)
