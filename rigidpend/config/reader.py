"""YAML as text with places: every key and value knows its line and column.

Scalars stay the text that was written, so that 1e-10, 0.1 and 3*pi/40 reach the schema as
they stand. What could surprise is refused: aliases, merges, tags, equal keys, several
documents, deep nesting, huge files.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import yaml

MAX_BYTES = 1_000_000
MAX_DEPTH = 32

Place: TypeAlias = tuple[str | int, ...]
"""Keys and indices from the root to a value."""


@dataclass(frozen=True)
class Origin:
    """Where a value was written: in a file, or in an option of the command line."""

    source: str
    line: int | None = None
    column: int | None = None
    text: str = ""
    """The source line, for the caret."""

    def __str__(self) -> str:
        return self.source if self.line is None else f"{self.source}:{self.line}:{self.column}"

    def shown(self) -> str:
        """The source line with a caret under the place; empty for an option."""
        if self.line is None or self.column is None or not self.text.strip():
            return ""
        return f"\n    {self.text}\n    {' ' * (self.column - 1)}^"


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with a config."""

    origin: Origin
    place: Place
    message: str

    def __str__(self) -> str:
        path = ".".join(map(str, self.place))
        middle = f" {path}:" if path else ""
        return f"{self.origin}:{middle} {self.message}{self.origin.shown()}"


class ConfigError(ValueError):
    """A config that cannot be used, with all that is wrong with it."""

    def __init__(self, problems: list[Problem]) -> None:
        self.problems = problems
        super().__init__("\n".join(map(str, problems)))


@dataclass
class Document:
    """A config as read: plain dicts, lists and texts, with the origin of each."""

    source: str
    tree: Any = None
    keys: dict[Place, Origin] = field(default_factory=dict)
    values: dict[Place, Origin] = field(default_factory=dict)
    settings: dict[Place, Origin] = field(default_factory=dict)
    """What options of the command line changed, inside of what the file holds."""

    def origin(self, place: Place, *, of_key: bool = False) -> Origin:
        """The origin of a value, or of the nearest thing around it that was written."""
        for changed, origin in self.settings.items():
            if changed[: len(place)] == place:
                return origin
        if of_key and place in self.keys:
            return self.keys[place]
        for length in range(len(place), 0, -1):
            near = place[:length]
            if near in self.values:
                # A missing entry is shown at the key that should hold it.
                held = length < len(place) and near in self.keys
                return self.keys[near] if held else self.values[near]
        return self.values.get((), Origin(self.source))


def read(path: Path) -> Document:
    """Read a YAML file.

    Raises
    ------
    ConfigError
        The file cannot be read or is not the plain YAML that configs are.
    """
    return parse(_text(path), str(path))


def parse(text: str, source: str) -> Document:
    """Read YAML text; `source` names it in messages."""
    document = Document(source)
    reader = _Reader(document, text.splitlines())
    try:
        document.tree = reader.document(yaml.parse(text, Loader=yaml.SafeLoader))
    except ConfigError:
        raise
    except yaml.MarkedYAMLError as error:
        reader.refuse(error.problem_mark, (), f"not YAML: {error.problem}")
    except (yaml.YAMLError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise ConfigError([Problem(Origin(source), (), f"not YAML: {reason}")]) from None
    return document


def override(document: Document, setting: str) -> None:
    """Apply a setting ``a.b=VALUE`` to a document, as if it were written there.

    Raises
    ------
    ConfigError
        It has no such form, or leads through something that has no entries.
    """
    origin = Origin(f"--set {setting}")
    path, equals, written = setting.partition("=")
    if not equals or not all(path.split(".")):
        raise ConfigError([Problem(origin, (), "expected KEY.KEY=VALUE, as in problem.mu=1e-3")])
    value = parse(written, str(origin))
    place: Place = ()
    holder = document.tree
    *outer, last = path.split(".")
    for word in outer:
        holder, place = _entry(document, holder, word, place, origin)
    key = _key(holder, last, place, origin)
    holder[key] = value.tree
    place = (*place, key)
    for origins in (document.keys, document.values):
        for old in [old for old in origins if old[: len(place)] == place]:
            del origins[old]
    document.keys[place] = document.values[place] = document.settings[place] = origin


def _entry(
    document: Document, holder: Any, text: str, place: Place, origin: Origin
) -> tuple[Any, Place]:
    """The value under a key, made if it is missing, and its place."""
    key = _key(holder, text, place, origin)
    inner = (*place, key)
    if isinstance(holder, dict) and key not in holder:
        holder[str(key)] = {}
        document.keys[inner] = document.values[inner] = origin
    return holder[key], inner


def _key(holder: Any, text: str, place: Place, origin: Origin) -> str | int:
    if isinstance(holder, dict):
        return text
    if isinstance(holder, list) and text in map(str, range(len(holder))):
        return int(text)
    kind = f"a list of {len(holder)}" if isinstance(holder, list) else "a single value"
    raise ConfigError([Problem(origin, place, f"has no entry {text!r}: it is {kind}")])


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ConfigError([Problem(Origin(str(path)), (), f"cannot be read: {reason}")]) from None
    if len(raw) > MAX_BYTES:
        message = f"larger than {MAX_BYTES} bytes, which no config is"
        raise ConfigError([Problem(Origin(str(path)), (), message)])
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        message = "not text in UTF-8"
        raise ConfigError([Problem(Origin(str(path), line, 1), (), message)]) from None


class _Reader:
    """Builds a document's tree from YAML events."""

    def __init__(self, document: Document, lines: list[str]) -> None:
        self.target, self.lines = document, lines

    def document(self, events: Iterator[Any]) -> Any:
        tree: Any = None
        documents = 0
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    self.refuse(event.start_mark, (), "a second document; a config has one")
                tree = self.node(next(events), events, ())
        return tree

    def node(self, event: Any, events: Iterator[Any], place: Place) -> Any:
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            self.refuse(event.start_mark, place, "anchors and aliases are not read: write it out")
        if getattr(event, "tag", None) is not None:
            self.refuse(event.start_mark, place, f"the tag {event.tag} is not read")
        if len(place) > MAX_DEPTH:
            self.refuse(event.start_mark, place[:3], f"nested deeper than {MAX_DEPTH}")
        self.target.values[place] = self.origin(event.start_mark)
        if isinstance(event, yaml.MappingStartEvent):
            return self.mapping(events, place)
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(events, place)
        return _scalar(event)

    def mapping(self, events: Iterator[Any], place: Place) -> dict[str, Any]:
        entries: dict[str, Any] = {}
        for event in events:
            if isinstance(event, yaml.MappingEndEvent):
                break
            if not isinstance(event, yaml.ScalarEvent):
                self.refuse(event.start_mark, place, "a key must be a plain word")
            key = event.value
            if key in entries:
                first = self.target.keys[(*place, key)]
                self.refuse(event.start_mark, (*place, key), f"given twice, first at {first}")
            self.target.keys[(*place, key)] = self.origin(event.start_mark)
            entries[key] = self.node(next(events), events, (*place, key))
        return entries

    def sequence(self, events: Iterator[Any], place: Place) -> list[Any]:
        entries: list[Any] = []
        for event in events:
            if isinstance(event, yaml.SequenceEndEvent):
                break
            entries.append(self.node(event, events, (*place, len(entries))))
        return entries

    def origin(self, mark: Any) -> Origin:
        text = self.lines[mark.line] if mark.line < len(self.lines) else ""
        return Origin(self.target.source, mark.line + 1, mark.column + 1, text)

    def refuse(self, mark: Any, place: Place, message: str) -> None:
        origin = self.origin(mark) if mark else Origin(self.target.source)
        raise ConfigError([Problem(origin, place, message)])


def _scalar(event: Any) -> str | bool | None:
    """The text as written; unquoted true, false and null are what they are in YAML 1.2."""
    if event.style is None:
        return {"true": True, "false": False, "null": None, "~": None, "": None}.get(
            event.value, event.value
        )
    return str(event.value)
