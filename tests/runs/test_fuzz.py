"""Whatever is in a config file: it loads, or it is refused with a ConfigError."""

from __future__ import annotations

import copy
import random
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidpend.config import catalogue, reader
from rigidpend.runs import loading
from tests.attacks import lot
from tests.config.samples import FIG4, TEXT
from tests.strategies import repeatable

Load = Callable[..., bool]

PATIENCE = 5.0
"""Seconds of this process that no config may take; the slowest takes a few tenths."""
FUZZED = lot.trials(150)
"""Number of mutated trees; a load takes some 7 ms."""
MUCH = 30_000
"""Characters that no complaint may have."""


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
    changed = copy.deepcopy(tree)
    for _ in range(chance.randint(1, 4)):
        _change(changed, chance)
    return _top(changed)


def settings(tree: Any, chance: random.Random) -> list[str]:
    """Some options ``a.b=VALUE``: places of a tree, or nearly, and any value."""
    made = []
    for _ in range(chance.randint(1, 3)):
        place = list(chance.choice([x for x, _ in _nodes(tree)]))
        if place and chance.random() < 0.2:
            place[chance.randrange(len(place))] = chance.choice(["", "x", "7", "-1", "A", "mu"])
        made.append(f"{'.'.join(place)}={_text(chance.choice(VALUES))}")
    return made


def _nodes(node: Any, place: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """All that a tree holds, each with its place."""
    yield place, node
    if isinstance(node, dict | list):
        for key, inner in node.items() if isinstance(node, dict) else enumerate(node):
            yield from _nodes(inner, (*place, str(key)))


def _change(tree: Any, chance: random.Random) -> None:
    """Write, delete, double, rename or exchange something, anywhere."""
    holder = chance.choice([x for _, x in _nodes(tree) if isinstance(x, dict | list)])
    keys: list[Any] = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
    if not keys:
        return
    key, other = chance.choice(keys), chance.choice(keys)
    kind = chance.randrange(6)
    if kind < 2:
        holder[key] = copy.deepcopy(chance.choice(VALUES))
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


def _top(tree: Any) -> str:
    return "".join(f"{key}: {_text(value)}\n" for key, value in tree.items())


def _text(node: Any) -> str:
    if isinstance(node, dict):
        return "{" + ", ".join(f"{key}: {_text(value)}" for key, value in node.items()) + "}"
    if isinstance(node, list):
        return "[" + ", ".join(map(_text, node)) + "]"
    return {None: "null", True: "true", False: "false"}.get(node, node)


@pytest.fixture(scope="module")
def loads(tmp_path_factory: pytest.TempPathFactory) -> Load:
    """Whether a content loads with settings; whatever is raised comes through, but ConfigErrors."""
    path = tmp_path_factory.mktemp("fuzz") / "given.yaml"

    def attempt(content: bytes, settings: Sequence[str] = ()) -> bool:
        path.write_bytes(content)
        begun = time.process_time()
        try:
            loading.load(path, settings)
        except loading.ConfigError as error:
            said = str(error)
        else:
            said = ""
        # What measures coverage slows every line.
        assert time.process_time() - begun < PATIENCE * (8 if sys.gettrace() else 1)
        assert len(said) < MUCH
        assert said == "" or said.startswith(("--set ", str(path)) if settings else str(path))
        assert all(x.isprintable() or x in "\n\t" for x in said), said
        return not said

    return attempt


@repeatable(50)
@given(content=st.binary(max_size=60) | st.text(max_size=60).map(str.encode))
def test_any_content_is_refused(loads: Load, content: bytes) -> None:
    assert not loads(content)


@pytest.mark.slow
def test_mutated_trees_and_any_settings_load_or_are_refused(loads: Load) -> None:
    every, loaded = trees(), 0
    with lot.drawn("mutated trees") as chance:
        for _ in range(FUZZED):
            text = mutated(chance.choice(every), chance)
            loaded += loads(text.encode("utf-8", "surrogatepass"))
            if chance.random() < 1 / 3:
                loads(FIG4.read_bytes(), settings(every[3], chance))
    # Some changes do no harm: the mutations are near enough to what is right.
    assert FUZZED / 140 < loaded < FUZZED / 1.75


@pytest.mark.slow
def test_the_largest_files_are_refused_in_time(loads: Load) -> None:
    much = reader.MAX_BYTES * 9 // 10 - len(TEXT)
    assert not loads(TEXT.replace("2, 1, 1.5", "[]," * (much // 3)).encode())
    for unit in ("k:\n", "{}\n", "--- \n", "- \n", "[", "*a ", "&a ", "'", '"\\x'):
        assert not loads((TEXT + unit * (much // len(unit))).encode())
