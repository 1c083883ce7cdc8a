"""Settings ``a.b=VALUE``, and sweeps: a config for each combination of values, named by them.

A setting is as if it were written in the file. A sweep is ``--sweep KEY=VALUE,VALUE``.
"""

import itertools
import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from rigidpend.config import reader
from rigidpend.config.complaints import ConfigError, Origin, Place
from rigidpend.config.reader import MOST_DEPTH, Document
from rigidpend.machine.files import CERTIFICATE
from rigidpend.numbers.texts import named

INDEXED = re.compile(r"\[(\w+)\]")
"""An index in brackets, as other languages write it."""
MOST_RESULTS = 1000
"""Most results of one sweep."""
LONGEST = 150
"""Largest number of characters of a name, which leaves room for suffixes of files."""
NAME = re.compile(r"\w[\w.,=+-]*")
"""Form of a name: no blank, no slash, and no dot or dash at its beginning."""
CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")
"""Characters, such as the end of a line, that no message can show."""
IN_NAMES = str.maketrans({"/": "over", "*": "x", " ": "", "[": "", "]": "", "(": "", ")": ""})
"""Replacements in file names for characters of numbers."""


Setting: TypeAlias = tuple[str, Origin]
"""Text ``KEY=VALUE`` and the option that asks for it."""


def override(document: Document, setting: str, origin: Origin) -> None:
    """Apply a setting ``a.b=VALUE`` to a document, as if it were written there.

    Complaints about it name its origin.
    """
    path, equals, written = setting.partition("=")
    if not equals or not all(path.split(".")):
        raise ConfigError.of(origin, "expected KEY.KEY=VALUE, as in problem.mu=1e-3")
    indexed = INDEXED.sub(r".\1", path)
    if indexed != path:
        raise ConfigError.of(origin, f"an entry of a list is written {indexed}={written}")
    # A setting must obey the reader's bound too, because recursion follows the depth.
    if path.count(".") >= MOST_DEPTH:
        raise ConfigError.of(origin, f"more than {MOST_DEPTH} keys inside each other")
    # An empty text is a missing value here, where YAML would read null.
    value = reader.value(written, origin) if written else ""
    place: Place = ()
    holder = document.tree
    *outer, last = path.split(".")
    for word in outer:
        key = _key(holder, word, place, origin)
        place = (*place, key)
        # A section that the file leaves out is created.
        if isinstance(holder, dict) and key not in holder:
            holder[key] = {}
            document.keys[place] = document.values[place] = origin
        holder = holder[key]
    key = _key(holder, last, place, origin)
    holder[key] = value
    place = (*place, key)
    # The file's values at and below this place are replaced: complaints go to the option.
    for origins in (document.keys, document.values):
        for old in [old for old in origins if old[: len(place)] == place]:
            del origins[old]
    document.keys[place] = document.values[place] = origin


def _key(holder: Any, text: str, place: Place, origin: Origin) -> str | int:
    if isinstance(holder, dict):
        return text
    if isinstance(holder, list) and text in map(str, range(len(holder))):
        return int(text)
    kind = f"a list of {len(holder)}" if isinstance(holder, list) else "a single value"
    raise ConfigError.of(origin, f"has no entry {text!r}: it is {kind}", place)


def option(text: str) -> list[Setting]:
    """Read an option ``KEY=VALUE,VALUE``: a setting for each value that the key takes in turn."""
    origin = Origin(f"--sweep {text}")
    key, equals, values = text.partition("=")
    if not equals or not all(key.split(".")):
        raise ConfigError.of(origin, "expected KEY.KEY=VALUE,VALUE, as in problem.mu=1e-4,1e-3")
    texts = [in_one_line(value) for value in reader.value(f"[{values}]", origin)]
    twice = [text for text in texts if texts.count(text) > 1]
    if len(texts) < 2:
        wrong = f"a sweep of {key} needs two values or more, as in {key}=1e-4,1e-3"
        raise ConfigError.of(origin, wrong)
    if twice:
        raise ConfigError.of(origin, f"the value {twice[0]} is given twice")
    return [(f"{key}={text}", origin) for text in texts]


def variants(sweeps: Sequence[Sequence[Setting]]) -> dict[str, Sequence[Setting]]:
    """Every combination of the settings of sweeps.

    Keys are the endings of the results' names; without sweeps there is one, the empty text. The
    last key's values change fastest.
    """
    origin = Origin("sweep")
    keys = [first.partition("=")[0] for (first, _), *_ in sweeps]
    if len(set(keys)) < len(keys):
        raise ConfigError.of(origin, f"a key is swept twice: {', '.join(keys)}")
    # One more than allowed shows that there are too many, before all are made.
    every = list(itertools.islice(itertools.product(*sweeps), MOST_RESULTS + 1))
    if len(every) > MOST_RESULTS:
        raise ConfigError.of(origin, f"more than {MOST_RESULTS} combinations")
    found: dict[str, Sequence[Setting]] = {}
    folded: dict[str, Sequence[Setting]] = {}
    for settings in every:
        name = ending([text.partition("=")[::2] for text, _ in settings])
        twin = folded.setdefault(name.casefold(), settings)
        if twin is not settings:
            both = " and ".join(", ".join(text for text, _ in x) for x in (twin, settings))
            raise ConfigError.of(origin, f"{both} would have the same name {name}")
        found[name] = settings
    return found


def ending(pairs: Sequence[tuple[str, str]]) -> str:
    """Ending of a name with values and their keys, as ``_mu=1e-3``."""
    short = short_names([key for key, _ in pairs])
    values = (value.translate(IN_NAMES) for _, value in pairs)
    return "".join(f"_{name}={value}" for name, value in zip(short, values, strict=True))


def check_name(name: str, origin: Origin) -> None:
    """Refuse a name of a result that cannot be the name of a file."""
    formed = isinstance(name, str) and NAME.fullmatch(name) and len(name) <= LONGEST
    if not formed or name == "all":
        message = f"a name is made of up to {LONGEST} letters, digits and _ . , = + -"
        raise ConfigError.of(origin, f"{message}; got {named(name)}")
    check_free(name, origin)


def check_free(name: str, origin: Origin) -> None:
    """Refuse a name that a result cannot store, or a line show, as text; or a certificate's."""
    if name != name.encode("utf-8", "replace").decode():
        raise ConfigError.of(origin, "the name of the file is not text in UTF-8: rename the file")
    if CONTROL.search(name):
        raise ConfigError.of(origin, f"no line can show the name {name!r}: rename the file")
    if name.casefold().endswith(CERTIFICATE):
        taken = f"names that end in {CERTIFICATE} are kept for proofs"
        raise ConfigError.of(origin, f"choose another name than {name!r}: {taken}")


def in_one_line(node: Any) -> str:
    """Write plain data as YAML in one line, numbers with the fewest digits that reproduce them."""
    # Arrays and numbers of NumPy have `tolist`; NumPy itself need not be imported.
    node = node.tolist() if hasattr(node, "tolist") else node
    if isinstance(node, Mapping):
        return "{" + ", ".join(f"{key}: {in_one_line(x)}" for key, x in node.items()) + "}"
    if isinstance(node, list | tuple):
        return f"[{', '.join(map(in_one_line, node))}]"
    # YAML writes true, false and null differently from Python.
    return str(node).lower() if isinstance(node, bool) else "null" if node is None else str(node)


def short_names(keys: Sequence[str]) -> list[str]:
    """Keys without their section, or whole keys where two would be equal.

    So a name depends on no other swept key, and results of different keys have different names.
    """
    short = [key.partition(".")[2] or key for key in keys]
    return [name if short.count(name) == 1 else key for name, key in zip(short, keys, strict=True)]
