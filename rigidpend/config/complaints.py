"""Complaints about a config and how they are shown, each with its place, its line and a caret."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

from rigidpend.machine.wording import plain

MOST_SHOWN = 20
"""Largest number of complaints that are shown; the rest are counted."""
MOST_MESSAGE = 300
"""Largest number of characters of a message that are shown."""
MOST_LINE = 160
"""Largest number of characters of a source line that are shown."""

Place: TypeAlias = tuple[str | int, ...]
"""Keys and indices from the root to a value."""


@dataclass(frozen=True)
class Origin:
    """Origin of a value: a place in a file, or an option of the command line."""

    source: str
    line: int | None = None
    column: int | None = None
    text: str = ""
    """The source line, for the caret."""

    def __deepcopy__(self, _: object) -> Origin:
        return self

    def __str__(self) -> str:
        return self.source if self.line is None else f"{self.source}:{self.line}:{self.column}"

    def shown(self) -> str:
        """The source line with a caret under the place; empty for an option."""
        if self.line is None or self.column is None or not self.text.strip():
            return ""
        # A long line is cut around the place, so that the caret is never outside.
        first = max(0, self.column - 1 - MOST_LINE // 2) if len(self.text) > MOST_LINE else 0
        shown = plain(self.text[first : first + MOST_LINE], MOST_LINE)
        before = shown[: self.column - 1 - first]
        return f"\n    {shown}\n    {''.join(map(_blank, before))}^"


@dataclass(frozen=True)
class Complaint:
    """One error in a config."""

    origin: Origin
    place: Place
    message: str
    configs: tuple[str, ...] = ()
    """Names of the configs that an option does not fit, if it fits others."""

    def __str__(self) -> str:
        place = ".".join(map(str, self.place))
        said = (place, self.message, ", ".join(self.configs), str(self.origin))
        path, message, configs, origin = (plain(text, MOST_MESSAGE) for text in said)
        middle = f" {path}:" if path else ""
        where = f"{configs}: {origin}" if configs else origin
        return f"{where}:{middle} {message}{self.origin.shown()}"


class ConfigError(ValueError):
    """Error: a config that cannot be used, with all its complaints."""

    def __init__(self, complaints: list[Complaint]) -> None:
        self.complaints = complaints
        said = [str(complaint) for complaint in complaints[:MOST_SHOWN]]
        if len(complaints) > MOST_SHOWN:
            said.append(f"and {len(complaints) - MOST_SHOWN} more")
        super().__init__("\n".join(said))

    @classmethod
    def of(cls, origin: Origin, message: str, place: Place = ()) -> ConfigError:
        """Make an error with a single complaint."""
        return cls([Complaint(origin, place, message)])


def meant(word: str, known: Iterable[str], cutoff: float = 0.5) -> str:
    """Suggestion of a known word that is close to an unknown one; empty if none is."""
    close = closest(word, known, cutoff)
    return f"; did you mean {close}?" if close else ""


def closest(word: str, known: Iterable[str], cutoff: float) -> str:
    """The known word that is closest to another; empty if none is as close as the cutoff."""
    import difflib

    small = {name.casefold(): name for name in known}
    near = difflib.get_close_matches(word.casefold(), list(small), 1, cutoff)
    return small[near[0]] if near else ""


def _blank(character: str) -> str:
    """Blank as wide as a character, to place the caret below the following one."""
    if character == "\t":
        return character
    return "  " if unicodedata.east_asian_width(character) in "WF" else " "
