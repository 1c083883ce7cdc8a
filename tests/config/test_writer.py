"""Configs as YAML: their comments whole, beside the values or above."""

from __future__ import annotations

import re

import pytest

from rigidpend.config.writer import BESIDE, WIDTH, _commented

SAID = " ".join(f"word{k}" for k in range(40))


@pytest.mark.parametrize("value", ["a: 1", f"a: {'1' * (BESIDE - 3)}", f"a: {'1' * BESIDE}"])
def test_comments_are_told_whole_in_lines_that_fit(value: str) -> None:
    lines = list(_commented([value], SAID, "  ", 10))
    beside = len(value) <= BESIDE
    assert re.findall(r"word\d+", " ".join(lines)) == SAID.split()
    assert max(map(len, lines)) <= WIDTH
    assert len(lines) > 3
    assert lines[0 if beside else -1].startswith(f"  {value}")
    assert len({line.index("#") for line in lines if "#" in line}) == 1
