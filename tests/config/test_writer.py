"""Configs as YAML: read back as the same, with every meaning whole; what differs in two."""

from pathlib import Path

import pytest

from rigidpend.config import reader, writer
from rigidpend.config.description import asked
from rigidpend.config.schema import Part
from rigidpend.config.writer import changes, sentence
from rigidpend.runs import loading, provenance
from tests.config.samples import FIG4, written

SHIPPED = sorted(FIG4.parent.glob("**/*.yaml"))


class Explained(Part):
    short: str
    """One."""
    fits: str
    """Many words that are told whole, beside a value which is as long as it may be for that."""
    long: str
    """Many words that are told whole, above a value which is longer by one character than that."""
    several: list[list[str]]
    """Texts."""


class Whole(Part):
    part: Explained
    """Whatever is explained."""


class Untold(Part):
    count: int


def test_a_setting_without_a_meaning_is_described_by_its_name() -> None:
    """A new one may not have it yet; only sections are described by their keys."""
    assert [tuple(row)[:2] for row in asked(Untold(count=3))] == [("count", "3")]


def test_comments_are_told_whole_in_lines_that_fit() -> None:
    values = {"short": "1", "fits": "1" * 30, "long": "1" * 31, "several": [["1", "2"], ["3"]]}
    assert (
        writer.to_yaml({"part": values}, Whole)
        == """
part:
  short: 1                              # One
  fits: 111111111111111111111111111111  # Many words that are told whole, beside
                                        # a value which is as long as it may be
                                        # for that
  # Many words that are told whole, above a value which is longer by one
  # character than that
  long: 1111111111111111111111111111111
  # Texts
  several:
  - [1, 2]
  - [3]
"""
    )


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
    [
        *("null", "true", "false", "~", "''", "'4: a # b'", "' 4 '", "4\\n5", "öäü", "'- a'"),
        *("[x", "*a"),
    ],
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
    assert sentence({"problem.beta0": (None, "1/2")}) == "problem.beta0 from gamma0 to 0.5"
