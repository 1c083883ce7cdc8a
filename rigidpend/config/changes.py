"""Changes from one config to another, key by key, as a person reads them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from rigidpend.numbers.expressions import as_written

SHOWN = 3
"""Number of changes that a sentence lists."""
ABSENT = "nothing"
"""Word for the value of a key that one of the two configs has not."""
WORDS = {"beta0": "gamma0"}
"""Words that a config has for null, by the last name of the key; `auto` elsewhere."""


class Change(NamedTuple):
    """A key whose value is another."""

    key: str
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.key} from {self.before} to {self.after}"


def changes(before: Mapping[str, Any], after: Mapping[str, Any], prefix: str = "") -> list[Change]:
    """Find the keys of two resolved configs whose values differ, in the order of the second.

    The name of the figure, on which no result depends, is passed over.
    """
    found = []
    for key in dict.fromkeys([*after, *before]):
        place = f"{prefix}{key}"
        old, new = before.get(key, ABSENT), after.get(key, ABSENT)
        if place == "figure" or old == new:
            continue
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            found += changes(old, new, f"{place}.")
        else:
            found.append(Change(place, written(old, key), written(new, key)))
    return found


def sentence(found: list[Change]) -> str:
    """Say what changed, the first few in full."""
    shown = ", ".join(map(str, found[:SHOWN]))
    more = len(found) - SHOWN
    return f"{shown}, and {more} more" if more > 0 else shown


def written(value: Any, key: str = "") -> str:
    """Write a value of a resolved config, and of a key, as in YAML, in one line."""
    if value is None:
        return WORDS.get(key, "auto")
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {written(x, key)}" for key, x in value.items()) + "}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(written, value))}]"
    return as_written(str(value))


def label(config: Mapping[str, Any], others: Sequence[Mapping[str, Any]]) -> str:
    """Say in short by what a config differs from others: ``mu = 1e-3, J1_0 = 1e-8``."""
    keys = {change.key for other in others for change in changes(other, config)}
    values = [(key, value) for key, value in _leaves(config) if key in keys]
    named = ((key.rpartition(".")[2], value) for key, value in values)
    return ", ".join(f"{key} = {written(value, key)}" for key, value in named)


def _leaves(node: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in node.items():
        yield f"{prefix}{key}", value
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
