"""One table, three forms: nothing is lost, cut or taken for markup."""

from __future__ import annotations

import math

import pytest

from rigidpend.machine.wording import (
    Column,
    Table,
    columns,
    html,
    markdown,
    seconds,
    terminal,
    times,
)

TABLE = Table("Times", ("method", "time"), [("a|b", "1 s"), ("<long name>", "20.5 ms")], "a note")


def test_a_table_is_made_of_columns_of_one_length_each_in_its_form() -> None:
    columns = [Column("n", range(2)), Column("x", [0.5, 2.0], ".2f")]
    found = Table.of("caption", columns, "note")
    assert found == Table("caption", ["n", "x"], [("0", "0.50"), ("1", "2.00")], "note")
    with pytest.raises(ValueError, match="shorter"):
        Table.of("", [*columns, Column("y", [1])])


def test_columns_are_wrapped_where_a_line_has_no_room() -> None:
    rows = [("a", "1.5, 2.5, 3.5", "meaning of a"), ("long", "7", "")]
    assert list(columns(rows, 80, " ")) == [
        " a     1.5, 2.5, 3.5  meaning of a",
        " long  7",
    ]
    narrow = list(columns(rows, 22))
    assert narrow == ["a     1.5,     meaning", "      2.5,     of a", "      3.5", "long  7"]
    assert list(columns([("one", "")], 3)) == ["one"]


def test_terminal_columns_are_aligned() -> None:
    assert list(terminal(TABLE)) == [
        "Times",
        "  method          time",
        "  a|b              1 s",
        "  <long name>  20.5 ms",
        "  a note",
        "",
    ]


def test_markdown_has_a_rule_and_escapes_bars() -> None:
    assert list(markdown(TABLE)) == [
        "Times",
        "",
        "| method | time |",
        "| --- | --- |",
        "| a&#124;b | 1 s |",
        "| <long name> | 20.5 ms |",
        "",
        "a note",
    ]
    assert next(markdown(TABLE._replace(caption=""))) == "| method | time |"


def test_html_escapes_every_cell() -> None:
    text = html(TABLE._replace(note="<b>"))
    assert "<td>&lt;long name&gt;</td>" in text
    assert '<p class="note">&lt;b&gt;</p>' in text
    assert text.count("<tr>") == 3


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.0, "1 s"),
        (0.0999, "99.9 ms"),
        (1.5e-6, "1.5 us"),
        (2e-9, "0.002 us"),
        (1234.0, "1,234 s"),
        (math.inf, "-"),
        (math.nan, "-"),
    ],
)
def test_times_have_units(value: float, text: str) -> None:
    assert seconds(value) == text


@pytest.mark.parametrize(("ratio", "text"), [(0.9555, "0.956"), (2285.7, "2,286"), (math.inf, "-")])
def test_ratios_have_three_digits(ratio: float, text: str) -> None:
    assert times(ratio) == text
