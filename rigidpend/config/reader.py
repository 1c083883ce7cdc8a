"""YAML reader that keeps numbers as text, and the line and column of every key and value.

Scalars stay the text that was written, so that 1e-10, 0.1 and 3*pi/40 reach the schema as
they stand. What could surprise is refused: aliases, merges, tags, equal keys, several
documents, deep nesting, huge files.
"""

import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import yaml

from rigidpend.config.complaints import ConfigError, Origin, Place

MOST_BYTES = 200_000
"""Largest size of a file; the largest shipped config has under two thousand bytes."""
MOST_VALUES = 10_000
"""Most values in a config, so that any config is read and checked within about a second."""
MOST_DEPTH = 32
"""Deepest nesting: configs need five levels, and recursion stays far from Python's limit."""
WORDS = {"true": True, "false": False, "null": None, "~": None, "": None}
"""Words that are not texts unless they are quoted, as in YAML 1.2."""


@dataclass
class Document:
    """A config as read: plain dicts, lists and texts, with the origin of each."""

    source: str
    tree: Any = None
    keys: dict[Place, Origin] = field(default_factory=dict)
    values: dict[Place, Origin] = field(default_factory=dict)

    def origin(self, place: Place, *, of_key: bool = False) -> Origin:
        """Origin of a value, or of the nearest enclosing value that was written."""
        # If an option changed a part of a section, complaints about the section name the option.
        for changed, origin in self.values.items():
            if origin.line is None and changed[: len(place)] == place:
                return origin
        if of_key and place in self.keys:
            return self.keys[place]
        for length in range(len(place), 0, -1):
            near = place[:length]
            if near in self.values:
                # A missing entry is shown at the key that should contain it.
                held = length < len(place) and near in self.keys
                return self.keys[near] if held else self.values[near]
        return self.values.get((), Origin(self.source))


def read(path: Path) -> Document:
    """Read a YAML file. Its document is that of other calls too: who changes it copies it."""
    return _parsed(_text(path), str(path))


def parse(text: str, source: str) -> Document:
    """Read YAML text; `source` names it in messages. ConfigError reports the first refusal."""
    document = Document(source)
    # Split at the line ends that YAML knows, so that its line numbers fit.
    reader = _Reader(document, re.split("\r\n|[\n\r\x85\u2028\u2029]", text))
    try:
        document.tree = reader.document(yaml.parse(text, Loader=yaml.SafeLoader))
    except ConfigError:
        raise
    except yaml.MarkedYAMLError as error:
        reader.stop(error.problem_mark, (), f"not YAML: {_reason(error)}")
    except (yaml.YAMLError, ValueError) as error:
        reason = str(error).splitlines()[0]
        line = text.count("\n", 0, getattr(error, "position", 0)) + 1
        raise ConfigError.of(Origin(source, line, 1), f"not YAML: {reason}") from None
    return document


_parsed = functools.lru_cache(maxsize=64)(parse)
"""The same of a text that is read again, which takes some milliseconds."""


def value(text: str, origin: Origin) -> Any:
    """Read the YAML of an option; refusals name the option as a whole."""
    try:
        return parse(text, origin.source).tree
    except ConfigError as error:
        [one] = error.complaints
        raise ConfigError.of(origin, one.message, one.place) from None


def _reason(error: yaml.MarkedYAMLError) -> str:
    """Reason that a text is no YAML, with the line where an unclosed part began."""
    reason, begun, found = str(error.problem), error.context_mark, error.problem_mark
    if "'\\t'" in reason:
        return f"{reason}: write spaces in place of the tab"
    if "found '<block " in reason:
        return f"{reason}: lines of one part must begin in one column"
    # For wrong indentation the beginning of the block would explain nothing.
    if not begun or not found or begun.line == found.line or "block" in str(error.context):
        return reason
    return f"{reason}, {error.context} that begins in line {begun.line + 1}"


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            # One byte more than allowed shows that a file is too large, without reading all of it.
            raw = file.read(MOST_BYTES + 1)
    except OSError as error:
        reason = f"cannot be read: {error.strerror or error}"
        raise ConfigError.of(Origin(str(path)), reason) from None
    if len(raw) > MOST_BYTES:
        message = f"larger than {MOST_BYTES} bytes, the most that a config may have"
        raise ConfigError.of(Origin(str(path)), message)
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise ConfigError.of(Origin(str(path), line, 1), "not text in UTF-8") from None


class _Reader:
    """Builder of a document's tree from YAML events."""

    def __init__(self, document: Document, lines: list[str]) -> None:
        self.target, self.lines = document, lines

    def document(self, events: Iterator[Any]) -> Any:
        tree: Any = None
        begun = False
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                if begun:
                    self.stop(event.start_mark, (), "a second document; a config has one")
                tree, begun = self.node(next(events), events, ()), True
        return tree

    def node(self, event: Any, events: Iterator[Any], place: Place) -> Any:
        if len(place) > MOST_DEPTH:
            self.stop(event.start_mark, place[:3], f"nested deeper than {MOST_DEPTH}")
        if len(self.target.values) >= MOST_VALUES:
            self.stop(event.start_mark, place[:1], f"more than {MOST_VALUES} values")
        if wrong := _refused(event):
            self.stop(event.start_mark, place, wrong)
        self.target.values[place] = self.origin(event.start_mark)
        if isinstance(event, yaml.MappingStartEvent):
            return self.mapping(events, place)
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(events, place)
        return _scalar(event)

    def mapping(self, events: Iterator[Any], place: Place) -> dict[str, Any]:
        entries: dict[str, Any] = {}
        while not isinstance(event := next(events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent) or not event.value.isprintable():
                self.stop(event.start_mark, place, "a key must be a plain word")
            inner = (*place, event.value)
            # In YAML the last of equal keys would win silently.
            if event.value in entries:
                said = f"given twice, first at {self.target.keys[inner]}"
                self.stop(event.start_mark, inner, said)
            self.target.keys[inner] = self.origin(event.start_mark)
            entries[event.value] = self.node(next(events), events, inner)
        return entries

    def sequence(self, events: Iterator[Any], place: Place) -> list[Any]:
        entries: list[Any] = []
        while not isinstance(event := next(events), yaml.SequenceEndEvent):
            entries.append(self.node(event, events, (*place, len(entries))))
        return entries

    def origin(self, mark: Any) -> Origin:
        text = self.lines[mark.line] if mark.line < len(self.lines) else ""
        return Origin(self.target.source, mark.line + 1, mark.column + 1, text)

    def stop(self, mark: Any, place: Place, message: str) -> NoReturn:
        """Refuse the document, for the content at a mark."""
        origin = self.origin(mark) if mark else Origin(self.target.source)
        raise ConfigError.of(origin, message, place)


def _refused(event: Any) -> str:
    """Reason to refuse a node; empty if it is accepted."""
    if isinstance(event, yaml.AliasEvent) or event.anchor:
        return "anchors and aliases are not allowed: write the value out"
    # Tags choose types, but types are the schema's choice.
    if event.tag is not None:
        return f"the tag {event.tag} is not allowed"
    value = getattr(event, "value", "")
    # By YAML's escapes a text could contain control characters, or half of a
    # surrogate pair, which no file can store.
    if any(
        (x < " " and x not in "\t\n") or "\x7f" <= x < "\xa0" or "\ud800" <= x < "\ue000"
        for x in value
    ):
        return f"a value with control characters: {value!r}"
    return ""


def _scalar(event: Any) -> str | bool | None:
    """Text of a scalar as written, or the value of a word of `WORDS`."""
    return event.value if event.style else WORDS.get(event.value, event.value)
