"""Settings ``a.b=VALUE``, and sweeps: a config for each combination of values, named by them.

A setting is as if it were written in the file. A sweep is asked for by ``--sweep
KEY=VALUE,VALUE``, or by the section ``sweep`` of a config::

    sweep:
      problem.mu: [1e-4, 1e-3, 1e-2]
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from rigidpend.config import reader
from rigidpend.config.complaints import Complaint, ConfigError, Origin, Place
from rigidpend.config.reader import MAX_DEPTH, Document
from rigidpend.machine.files import CERTIFICATE
from rigidpend.numbers.expressions import named

INDEXED = re.compile(r"\[(\w+)\]")
"""An index as other languages write it."""
SECTION = "sweep"
"""The key of a config under which a sweep stands."""
MOST = 1000
"""Most results of one sweep."""
LONGEST = 150
"""Characters of a name at most, which leaves room for what is added to it in files."""
NAME = re.compile(r"\w[\w.,=+-]*")
"""Form of a name: no blank, no slash, and no point or dash at its beginning."""
DEVICE = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
"""Names that are devices on Windows, whatever ending they have."""
IN_NAMES = str.maketrans({"/": "over", "*": "", " ": "", "[": "", "]": "", "(": "", ")": ""})
"""Stand-ins in names of files for what numbers are written with."""
FORM = "expected KEY.KEY=VALUE,VALUE, as in problem.mu=1e-4,1e-3"
"""Complaint about an option of another form."""


class Sweep(NamedTuple):
    """A key and the values that it takes in turn, as they are written."""

    key: str
    values: tuple[str, ...]
    origin: Origin = Origin("sweep")
    """The option or the place in a file that asks for it."""


class Variant(NamedTuple):
    """One combination of the values of several sweeps."""

    ending: str
    """Ending of the name of its result; empty where nothing is swept."""
    settings: tuple[tuple[str, Origin], ...]
    """Settings ``KEY=VALUE``, each with the origin of its sweep."""


def override(document: Document, setting: str, origin: Origin | None = None) -> None:
    """Apply a setting ``a.b=VALUE`` to a document, as if it were written there.

    Complaints about it name its origin, the option ``--set`` if none is given.

    Raises
    ------
    ConfigError
        It has no such form, or leads through something that has no entries.
    """
    origin = origin or Origin(f"--set {setting}")
    path, equals, written = setting.partition("=")
    if not equals or not all(path.split(".")):
        raise ConfigError([Complaint(origin, (), "expected KEY.KEY=VALUE, as in problem.mu=1e-3")])
    indexed = INDEXED.sub(r".\1", path)
    if indexed != path:
        message = f"an entry of a list is written {indexed}={written}"
        raise ConfigError([Complaint(origin, (), message)])
    # The reader's bound, which a setting would pass by: recursion follows the depth.
    if path.count(".") >= MAX_DEPTH:
        message = f"more than {MAX_DEPTH} keys inside each other"
        raise ConfigError([Complaint(origin, (), message)])
    # Nothing is no value, and not YAML's null either.
    value = reader.value(written, origin) if written else ""
    place: Place = ()
    holder = document.tree
    *outer, last = path.split(".")
    for word in outer:
        holder, place = _entry(document, holder, word, place, origin)
    key = _key(holder, last, place, origin)
    holder[key] = value
    place = (*place, key)
    # What the file said at this place and below is gone: complaints go to the option.
    for origins in (document.keys, document.values):
        for old in [old for old in origins if old[: len(place)] == place]:
            del origins[old]
    document.keys[place] = document.values[place] = document.settings[place] = origin


def _entry(
    document: Document, holder: Any, text: str, place: Place, origin: Origin
) -> tuple[Any, Place]:
    """Value under a key, made if it is missing, and its place."""
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
    raise ConfigError([Complaint(origin, place, f"has no entry {text!r}: it is {kind}")])


def option(text: str) -> Sweep:
    """Read an option ``KEY=VALUE,VALUE``.

    Raises
    ------
    ConfigError
        It has no such form, or only one value, or one value twice.
    """
    origin = Origin(f"--sweep {text}")
    key, equals, values = text.partition("=")
    if not equals or not all(key.split(".")):
        raise ConfigError([Complaint(origin, (), FORM)])
    return _sweep(key, reader.value(f"[{values}]", origin), origin, ())


def taken_from(document: Document) -> list[Sweep]:
    """Take the section ``sweep`` out of a config.

    Raises
    ------
    ConfigError
        It is not made of keys with lists of values.
    """
    place: Place = (SECTION,)
    section = document.tree.pop(SECTION, {})
    if not isinstance(section, dict):
        message = "expected keys with lists of values, as in problem.mu: [1e-4, 1e-3]"
        raise ConfigError([Complaint(document.origin(place), place, message)])
    return [
        _sweep(key, values, document.origin((SECTION, key)), (SECTION, key))
        for key, values in section.items()
    ]


def variants(sweeps: Sequence[Sweep]) -> list[Variant]:
    """Every combination of the values, the last key's changing first.

    Raises
    ------
    ConfigError
        A key is swept twice, there are too many, or two would have the same name.
    """
    origin = Origin("sweep")
    keys = [sweep.key for sweep in sweeps]
    if len(set(keys)) < len(keys):
        raise ConfigError([Complaint(origin, (), f"a key is swept twice: {', '.join(keys)}")])
    found = []
    # One more than allowed shows that there are too many, before all are made.
    for values in itertools.islice(itertools.product(*(s.values for s in sweeps)), MOST + 1):
        pairs = list(zip(keys, values, strict=True))
        settings = zip((f"{key}={x}" for key, x in pairs), (s.origin for s in sweeps), strict=True)
        found.append(Variant(ending(pairs), tuple(settings)))
    if len(found) > MOST:
        raise ConfigError([Complaint(origin, (), f"more than {MOST} combinations")])
    if len({variant.ending.casefold() for variant in found}) < len(found):
        raise ConfigError([Complaint(origin, (), "two values would have the same name")])
    return found


def ending(pairs: Sequence[tuple[str, str]]) -> str:
    """Ending of a name that tells values by their keys."""
    short = short_names([key for key, _ in pairs])
    values = (value.translate(IN_NAMES) for _, value in pairs)
    return "".join(f"_{name}={value}" for name, value in zip(short, values, strict=True))


def checked_name(name: str, origin: Origin) -> str:
    """A name of a result, if it can be one of a file on any system.

    Raises
    ------
    ConfigError
        It cannot.
    """
    formed = isinstance(name, str) and NAME.fullmatch(name) and len(name) <= LONGEST
    if not formed or name == "all":
        message = f"a name is made of up to {LONGEST} letters, digits and _ . , = + -"
        raise ConfigError([Complaint(origin, (), f"{message}; got {named(name)}")])
    return free_name(name, origin)


def free_name(name: str, origin: Origin) -> str:
    """A name, if it is not one of something else.

    Raises
    ------
    ConfigError
        It is that of a certificate, or of a device on some system.
    """
    if name.casefold().endswith(CERTIFICATE):
        taken = f"what ends in {CERTIFICATE} is the proof of a result"
    elif DEVICE.fullmatch(name):
        taken = "it is a device on Windows"
    elif name.endswith("."):
        taken = "Windows leaves out the point at its end"
    else:
        return name
    raise ConfigError([Complaint(origin, (), f"choose another name than {name!r}: {taken}")])


def _sweep(key: str, values: Any, origin: Origin, place: Place) -> Sweep:
    """Check the values of a key, and write each as a setting has it."""
    if key.split(".")[0] == SECTION:
        message = f"a sweep cannot change the section {SECTION}: write {key.partition('.')[2]}"
        raise ConfigError([Complaint(origin, place, message)])
    if isinstance(values, dict):
        inner = next(iter(values), "KEY")
        message = f"a swept key is written whole, as in {key}.{inner}: [1e-4, 1e-3]"
        raise ConfigError([Complaint(origin, place, message)])
    if not isinstance(values, list) or len(values) < 2:
        message = f"a sweep of {key} needs two values or more, as in {key}=1e-4,1e-3"
        raise ConfigError([Complaint(origin, place, message)])
    texts = tuple(map(_in_one_line, values))
    twice = [text for text in texts if texts.count(text) > 1]
    if twice:
        raise ConfigError([Complaint(origin, place, f"the value {twice[0]} is given twice")])
    return Sweep(key, texts, origin)


def _in_one_line(node: Any) -> str:
    """Write plain data as YAML in one line."""
    if isinstance(node, dict):
        return "{" + ", ".join(f"{key}: {_in_one_line(x)}" for key, x in node.items()) + "}"
    if isinstance(node, list):
        return f"[{', '.join(map(_in_one_line, node))}]"
    return {None: "null", True: "true", False: "false"}.get(node, node)


def short_names(keys: Sequence[str]) -> list[str]:
    """Last words of keys; the whole key where two would be alike."""
    last = [".".join(_tail(key)) for key in keys]
    return [name if last.count(name) == 1 else key for name, key in zip(last, keys, strict=True)]


def _tail(key: str) -> Iterator[str]:
    """Last word of a key, with the one before it where it is the index of a list."""
    *_, before, last = ["", *key.split(".")]
    yield from (before, last) if last.isdigit() else (last,)
