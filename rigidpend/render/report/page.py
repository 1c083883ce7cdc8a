"""Page of the report: its parts as plain records, and their HTML."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rigidpend.machine import tables
from rigidpend.machine.tables import Table
from rigidpend.render.report.departures import Departure

HERE = Path(__file__).parent
COLOURS = 128
"""Colours of an image in the page."""


class ResultSection(NamedTuple):
    """A result's part of the page."""

    name: str
    figure: str
    experiment: str
    picture: str
    """Image as a data URI."""
    caption: str
    """Sentences on what the figure shows."""
    bodies: Sequence[str]
    """Phrases on the body, or on each of them."""
    tables: Sequence[Table]
    provenance: Sequence[tuple[str, str]]
    problem: str = ""
    """Reason why nothing is shown."""
    doubt: str = ""
    """Doubt about what is shown, or about what is missing beside it."""

    @property
    def title(self) -> str:
        if self.problem:
            return self.name
        what = self.experiment.replace("_", " ")
        if self.of_the_paper:
            return f"Fig. {self.figure}: {what}"
        named = "" if self.name == self.experiment else f": {self.name}"
        return f"{what.capitalize()}{named}"

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
    return ResultSection(name, "", "", "", "", (), (), (), said)


def picture(png: bytes) -> str:
    """Encode an image as a data URI, so that the page needs no other file.

    Its colours are reduced to a palette, by which it takes a third of the room: figures have few.
    """
    from PIL import Image

    small = io.BytesIO()
    with Image.open(io.BytesIO(png)) as full:
        # Without dithering, whose noise in flat colours would not compress.
        reduced = full.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
        # The usual compression: the best takes five times as long for a twentieth of the room.
        reduced.save(small, "png")
    return f"data:image/png;base64,{base64.b64encode(small.getvalue()).decode('ascii')}"


def html(sections: Sequence[ResultSection], departures: Sequence[Departure]) -> str:
    """Write the whole page as HTML."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        # A name that the template has and the page has not is an error, and no gap in the page.
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
        departures,
    )
    return template.render(sections=sections, departures=slips, style=style)
