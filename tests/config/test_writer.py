"""Configs as YAML: read back as the same, with every meaning whole; what differs in two."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rigidpend.config import reader, writer
from rigidpend.config.writer import BESIDE, WIDTH, changes, sentence
from rigidpend.runs import loading, provenance
from tests.config.samples import FIG4, written

SHIPPED = sorted(FIG4.parent.glob("**/*.yaml"))
SAID = " ".join(f"word{k}" for k in range(40))


@pytest.mark.parametrize("value", ["a: 1", f"a: {'1' * (BESIDE - 3)}", f"a: {'1' * BESIDE}"])
def test_comments_are_told_whole_in_lines_that_fit(value: str) -> None:
    lines = list(writer._commented([value], SAID, "  ", 10))
    beside = len(value) <= BESIDE
    assert re.findall(r"word\d+", " ".join(lines)) == SAID.split()
    assert max(map(len, lines)) <= WIDTH
    assert len(lines) > 3
    assert lines[0 if beside else -1].startswith(f"  {value}")
    assert len({line.index("#") for line in lines if "#" in line}) == 1


@pytest.mark.slow
@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_resolved_config_is_read_back_as_the_same(path: Path, tmp_path: Path) -> None:
    loaded = loading.load(path)
    text = loading.resolved_yaml(loaded)
    assert all(len(line) <= 80 for line in text.splitlines())
    again = loading.load(written(tmp_path, text))
    assert again.resolved() == loaded.resolved() | {"figure": ""}
    assert provenance.config_hash(again.resolved()) == provenance.config_hash(loaded.resolved())
    # Nothing is left to a default, and every key has its meaning.
    assert loading.resolved_yaml(again) == text
    assert text.count("# ") >= len(loaded.resolved()["problem"]) // 2


@pytest.mark.slow
def test_a_resolved_config_has_its_numbers_as_they_were_written() -> None:
    text = loading.resolved_yaml(loading.load(FIG4, ["problem.mu=2e-3"]))
    for line in ("A: [2, 1, 1.5] ", "h0: 1.3342 ", "J1_0: 1e-8 ", "mu: 2e-3 ", "engine: auto "):
        assert f"\n  {line}" in text
    assert "A3 >= A1; physical units" in " ".join(text.replace("#", "").split())
    assert not {"null", "figure:"} & set(text.split())
    fig3 = loading.resolved_yaml(loading.load(FIG4.with_name("fig3.yaml")))
    assert "\n  beta0: gamma0 " in fig3


@pytest.mark.parametrize(
    "text",
    ["null", "true", "~", "''", "'4: a # b'", "' 4 '", "4\\n5", "öäü", "'- a'", "[x", "*a"],
)
def test_any_text_is_read_back_as_it_was_written(text: str) -> None:
    assert reader.parse("\n".join(writer.dumped({"key": text})), "here").tree == {"key": text}


def test_changes_are_told_from_what_to_what() -> None:
    before = loading.load(FIG4).resolved()
    after = loading.load(FIG4, ["problem.mu=1e-2", "numerics.engine=scipy"]).resolved()
    found = changes(before, after)
    assert sentence(found) == "problem.mu from 0.001 to 0.01, numerics.engine from auto to scipy"
    assert sentence(dict.fromkeys("abcdef", ("1", "2"))).endswith(", and 3 more")
    assert changes(before, before) == {}
    one, other = {"a": 1, "b": {"x": 1}}, {"b": {"x": 1, "y": 2}}
    assert changes(one, other) == {"b.y": ("nothing", 2), "a": (1, "nothing")}


def test_the_word_for_null_is_that_of_the_config() -> None:
    before, after = {"problem": {"beta0": None}}, {"problem": {"beta0": "1/2"}}
    assert sentence(changes(before, after)) == "problem.beta0 from gamma0 to 0.5"
