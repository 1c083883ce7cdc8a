"""Whatever is in a config file: it loads, or it is refused with a ConfigError."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidpend.config import reader
from rigidpend.runs import loading
from tests.attacks import lot
from tests.config import mutations
from tests.config.samples import FIG4, TEXT
from tests.strategies import repeatable

Load = Callable[[bytes], bool]

PATIENCE = 5.0
"""Seconds of this process that no config may take; the slowest takes a few tenths."""
FUZZED = lot.trials(150)
"""Number of mutated trees; a load takes some 7 ms."""
MUCH = 30_000
"""Characters that no complaint may have."""


@pytest.fixture(scope="module")
def loads(tmp_path_factory: pytest.TempPathFactory) -> Load:
    """Whether a content loads; whatever is raised comes through, but for a ConfigError."""
    path = tmp_path_factory.mktemp("fuzz") / "given.yaml"

    def attempt(content: bytes) -> bool:
        path.write_bytes(content)
        begun = time.process_time()
        try:
            loading.load(path)
        except loading.ConfigError as error:
            said = str(error)
        else:
            said = ""
        # What measures coverage slows every line.
        assert time.process_time() - begun < PATIENCE * (8 if sys.gettrace() else 1)
        assert len(said) < MUCH
        assert said == "" or said.startswith(str(path))
        assert all(x.isprintable() or x in "\n\t" for x in said), said
        return not said

    return attempt


@repeatable(50)
@given(content=st.binary(max_size=60) | st.text(max_size=60).map(str.encode))
def test_any_content_is_refused(loads: Load, content: bytes) -> None:
    assert not loads(content)


@pytest.mark.slow
def test_mutated_trees_load_or_are_refused(loads: Load) -> None:
    trees, loaded = mutations.trees(), 0
    with lot.drawn("mutated trees") as chance:
        for _ in range(FUZZED):
            text = mutations.mutated(chance.choice(trees), chance)
            loaded += loads(text.encode("utf-8", "surrogatepass"))
    # Some changes do no harm: the mutations are near enough to what is right.
    assert FUZZED / 140 < loaded < FUZZED / 1.75


@pytest.mark.slow
def test_any_settings_load_or_are_refused() -> None:
    tree = mutations.trees()[3]
    with lot.drawn("settings") as chance:
        for _ in range(lot.trials(50)):
            given = mutations.settings(tree, chance)
            said = ""
            try:
                loading.load(FIG4, given)
            except loading.ConfigError as error:
                said = str(error)
            assert said == "" or said.startswith(("--set ", str(FIG4))), given


@pytest.mark.slow
def test_the_largest_files_are_refused_in_time(loads: Load) -> None:
    much = reader.MAX_BYTES * 9 // 10 - len(TEXT)
    assert not loads(TEXT.replace("2, 1, 1.5", "[]," * (much // 3)).encode())
    for unit in ("k:\n", "{}\n", "--- \n", "- \n", "[", "*a ", "&a ", "'", '"\\x'):
        assert not loads((TEXT + unit * (much // len(unit))).encode())
