"""One table, three forms: nothing is lost, cut or taken for markup."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from rigidpend.machine.wording import (
    Column,
    Table,
    columns,
    counted,
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
    assert list(columns(rows, 80, " ")) == [" a     1.5, 2.5, 3.5  meaning of a", " long  7"]
    narrow = list(columns(rows, 22))
    assert narrow == ["a     1.5,     meaning", "      2.5,     of a", "      3.5", "long  7"]
    assert list(columns([("one", "")], 3)) == ["one"]


def test_a_table_has_three_forms_which_align_or_escape_every_cell() -> None:
    assert list(terminal(TABLE)) == [
        "Times",
        "  method          time",
        "  a|b              1 s",
        "  <long name>  20.5 ms",
        "  a note",
        "",
    ]
    rows = ["| method | time |", "| --- | --- |", "| a&#124;b | 1 s |", "| <long name> | 20.5 ms |"]
    assert list(markdown(TABLE)) == ["Times", "", *rows, "", "a note"]
    assert next(markdown(TABLE._replace(caption=""))) == rows[0]
    text = html(TABLE._replace(note="<b>"))
    assert "<td>&lt;long name&gt;</td>" in text
    assert '<p class="note">&lt;b&gt;</p>' in text
    assert text.count("<tr>") == 3


@pytest.mark.parametrize(
    ("write", "value", "text"),
    [
        (seconds, 1.0, "1 s"),
        (seconds, 0.0999, "99.9 ms"),
        (seconds, 1.5e-6, "1.5 us"),
        (seconds, 2e-9, "0.002 us"),
        (seconds, 1234.0, "1,234 s"),
        (seconds, math.inf, "-"),
        (seconds, math.nan, "-"),
        (times, 0.9555, "0.956"),
        (times, 2285.7, "2,286"),
        (times, math.inf, "-"),
    ],
)
def test_times_have_units_and_ratios_three_digits(
    write: Callable[[float], str], value: float, text: str
) -> None:
    assert write(value) == text


def test_one_thing_is_counted_without_a_plural() -> None:
    assert [counted(n, "orbit") for n in (0, 1, 2)] == ["0 orbits", "1 orbit", "2 orbits"]
