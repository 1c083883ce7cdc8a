"""The README against what it speaks of."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rigidpend.departures import DEPARTURES
from scripts import readme_tables

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def rows_under(heading: str) -> list[tuple[str, ...]]:
    """The rows of the first table under a heading, without its head."""
    text = README.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [tuple(cell.strip() for cell in line.strip("|").split(" | ")) for line in lines[2:]]


def test_the_departures_are_those_of_the_package() -> None:
    assert rows_under("Departures from the paper") == [d.row for d in DEPARTURES]


def test_every_file_that_it_points_to_is_there() -> None:
    targets = re.findall(r"\]\(([^)#:]+)\)", README)
    assert targets
    for target in targets:
        assert (ROOT / target).exists(), target


def test_the_tables_of_the_benchmark_are_those_of_the_stored_measurement() -> None:
    assert (readme_tables.MEASURED / "bench.h5").is_file()
    assert readme_tables.renewed(README) == README


def test_a_figure_that_is_not_the_measured_one_is_noticed() -> None:
    block = README.partition("<!-- bench -->")[2].partition("<!-- /bench -->")[0]
    number = re.search(r"\d\.\d+ ms", block)
    assert number
    slipped = README.replace(number[0], f"9{number[0]}", 1)
    assert readme_tables.renewed(slipped) == README


def test_a_block_that_is_not_there_is_missed() -> None:
    with pytest.raises(SystemExit, match="no block bench"):
        readme_tables.renewed(README.replace("<!-- bench -->", ""))
