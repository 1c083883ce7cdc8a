"""Wrong configs without end: trees of the shipped ones with something changed, and their text."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

from rigidpend.config import catalogue, reader

VALUES: list[Any] = [
    *("nan", ".nan", "inf", "-.inf", "1e400", "1e-400", "1e5000", "-1", "0", "-0.0", "1/0", "0/0"),
    *("no", "yes", "on", "null", "~", "true", "false", "auto", "''", '""', "'1'", "1:30", "0x1F"),
    *("1_000", "٣", "½", "1j", "1e", "e1", ".", "+", "--1", "pi", "-pi", "sqrt(-1)", "tan(pi/2)"),
    *("2**-2000", "9**9**9", "(((1)))", "sin(" * 60 + "1" + ")" * 60, "9" * 400, "0." + "3" * 400),
    *("&a 1", "*a", "!!float 1", "!x 1", "<<", "---", "...", "# c", "a: b", "- a", "[", "]", "{"),
    *('"\\0"', '"\\ud800"', '"\\e[31m"', "\x07", "\u2028", "\ufeff", "日本", "a" * 300, "a b"),
    *("scipy", "taylor", "tailor", "route_codes", "gamma0", "left", "fig4"),
    *([], {}, ["1"], ["1", "2", "3"], [["1", "2", "3"]], {"a": "1"}, {"": []}, ["1"] * 99),
    *({"start": "0", "step": "1", "count": "1e9"}, [[[[[["1"]]]]]]),
]
"""What may be written where something else belongs; texts stand as they are."""


def trees() -> list[Any]:
    """The shipped configs, as read; of several bodies, which cost time, the first two."""
    read = [reader.read(path).tree for path in catalogue.known().values()]
    for tree in read:
        bodies = tree["problem"].get("bodies", {})
        for name in list(bodies)[2:]:
            del bodies[name]
    return read


def mutated(tree: Any, chance: random.Random) -> str:
    """The text of a tree after one to four changes."""
    copy = _copied(tree)
    for _ in range(chance.randint(1, 4)):
        _change(copy, chance)
    return _top(copy)


def settings(tree: Any, chance: random.Random) -> list[str]:
    """Some options ``a.b=VALUE``: places of a tree, or nearly, and any value."""
    made = []
    for _ in range(chance.randint(1, 3)):
        place = [str(x) for x in chance.choice(list(_places(tree, ())))]
        if place and chance.random() < 0.2:
            place[chance.randrange(len(place))] = chance.choice(["", "x", "7", "-1", "A", "mu"])
        made.append(f"{'.'.join(place)}={_text(chance.choice(VALUES))}")
    return made


def _places(node: Any, place: tuple[Any, ...]) -> Iterator[tuple[Any, ...]]:
    yield place
    inner = node.items() if isinstance(node, dict) else enumerate(node)
    if isinstance(node, dict | list):
        for key, value in inner:
            yield from _places(value, (*place, key))


def _change(tree: Any, chance: random.Random) -> None:
    """Write, delete, double, rename or exchange something, anywhere."""
    holder: Any = chance.choice(list(_holders(tree)))
    keys: list[Any] = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
    if not keys:
        return
    key, other = chance.choice(keys), chance.choice(keys)
    kind = chance.randrange(6)
    if kind < 2:
        holder[key] = _copied(chance.choice(VALUES))
    elif kind == 2:
        del holder[key]
    elif kind == 3:
        holder[key], holder[other] = holder[other], holder[key]
    elif kind == 4:
        holder[key] = [holder[key]] if chance.random() < 0.5 else {str(other): holder[key]}
    elif isinstance(holder, dict):
        # A key twice, where the text is the same: a blank at its end is none in YAML.
        name = chance.choice([f"{key} ", f"{key}x", str(key)[1:], "<<", "? a", "'", "mu", "[a]"])
        holder[name] = holder[key]
    else:
        holder.append(holder[key])


def _holders(node: Any) -> Iterator[Any]:
    if isinstance(node, dict | list):
        yield node
        for inner in list(node.values()) if isinstance(node, dict) else node:
            yield from _holders(inner)


def _copied(node: Any) -> Any:
    if isinstance(node, dict):
        return {key: _copied(value) for key, value in node.items()}
    return [_copied(value) for value in node] if isinstance(node, list) else node


def _top(tree: Any) -> str:
    """Lines `key: value`, values in brackets."""
    return "".join(f"{key}: {_text(value)}\n" for key, value in tree.items())


def _text(node: Any) -> str:
    """A node in YAML's flow style, texts as they are, right or wrong."""
    if isinstance(node, dict):
        return "{" + ", ".join(f"{key}: {_text(value)}" for key, value in node.items()) + "}"
    if isinstance(node, list):
        return "[" + ", ".join(map(_text, node)) + "]"
    return {None: "null", True: "true", False: "false"}.get(node, node)
