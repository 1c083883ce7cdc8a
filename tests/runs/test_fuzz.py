"""Whatever is in a config file: it loads, or it is refused with a ConfigError."""

from __future__ import annotations

import random
import re
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

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
"""Number of mutated configs; a load takes some 7 ms."""
MUCH = 30_000
"""Characters that no complaint may have."""


VALUES = [
    *("nan", ".nan", "inf", "-.inf", "1e400", "1e-400", "1e5000", "-1", "0", "-0.0", "1/0", "0/0"),
    *("no", "yes", "on", "null", "~", "true", "false", "auto", "''", '""', "'1'", "1:30", "0x1F"),
    *("1_000", "٣", "½", "1j", "1e", "e1", ".", "+", "--1", "pi", "-pi", "sqrt(-1)", "tan(pi/2)"),
    *("2**-2000", "9**9**9", "(((1)))", "sin(" * 60 + "1" + ")" * 60, "9" * 400, "0." + "3" * 400),
    *("&a 1", "*a", "!!float 1", "!x 1", "<<", "---", "...", "# c", "a: b", "- a", "[", "]", "{"),
    *('"\\0"', '"\\ud800"', '"\\e[31m"', "\x07", "\u2028", "\ufeff", "日本", "a" * 300, "a b"),
    *("scipy", "taylor", "tailor", "route_codes", "gamma0", "left", "fig4", "mu", "? a", "[a]"),
    *("", "[]", "{}", "[1]", "[1, 2, 3]", "[[1, 2, 3]]", "{a: 1}", "{'': []}", f"{['1'] * 99}"),
    *("{start: 0, step: 1, count: 1e9}", "[[[[[[1]]]]]]"),
]
"""What may be written where something else belongs."""
WORD, LINE = re.compile(r"[^\s,:\[\]{}]+"), re.compile(r"^.*\n", re.MULTILINE)
PLACES = [
    *("problem", "problem.A", "problem.A.1", "problem.A.7", "problem.mu", "problem.mu.x"),
    *("problem..mu", "problem.x", "problem.arrays", "problem.arrays.left", "problem.n_symbols"),
    *("problem.arrays.x.count", "numerics.precisions", "numerics.precisions.0", "numerics.engine"),
    *("figure", "experiment", "A", "x", "7"),
]
"""Keys of settings, or nearly."""


def mutated(text: str, chance: random.Random) -> str:
    """A text with one to four words replaced or exchanged, or lines doubled or left out."""
    for _ in range(chance.randint(1, 4)):
        kind = chance.choice([WORD, WORD, LINE])
        old, other = chance.choices([*kind.finditer(text)], k=2)
        words = [chance.choice(VALUES), f"{old[0]} ", f"{old[0]}x", other[0], f"[{old[0]}]"]
        new = chance.choice(words if kind is WORD else ["", 2 * old[0], other[0]])
        text = text[: old.start()] + new + text[old.end() :]
    return text


def without_comments(path: Path) -> str:
    return re.sub(r"(^|\s)#.*", "", path.read_text(encoding="utf-8"))


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
def test_mutated_configs_and_any_settings_load_or_are_refused(loads: Load) -> None:
    texts, loaded = [*map(without_comments, catalogue.known().values())], 0
    with lot.drawn("mutated configs") as chance:
        for _ in range(FUZZED):
            text = mutated(chance.choice(texts), chance)
            loaded += loads(text.encode("utf-8", "surrogatepass"))
            if chance.random() < 1 / 3:
                pairs = zip(chance.choices(PLACES, k=2), chance.choices(VALUES, k=2), strict=True)
                loads(FIG4.read_bytes(), [f"{place}={value}" for place, value in pairs])
    # Some changes do no harm: the mutations are near enough to what is right.
    assert FUZZED / 140 < loaded < FUZZED / 1.75


@pytest.mark.slow
def test_the_largest_files_are_refused_in_time(loads: Load) -> None:
    much = reader.MAX_BYTES * 9 // 10 - len(TEXT)
    assert not loads(TEXT.replace("2, 1, 1.5", "[]," * (much // 3)).encode())
    for unit in ("k:\n", "{}\n", "--- \n", "- \n", "[", "*a ", "&a ", "'", '"\\x'):
        assert not loads((TEXT + unit * (much // len(unit))).encode())
