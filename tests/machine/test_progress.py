"""Words for people: progress and the time that is left, tables of text, numbers."""

from __future__ import annotations

import contextlib
import io
import math
import re
from collections.abc import Callable
from typing import Any

import pytest

from rigidpend.machine import wording
from rigidpend.machine.progress import PartDone, Progress, duration
from rigidpend.machine.wording import (
    Column,
    Table,
    columns,
    counted,
    markdown,
    seconds,
    times,
)


class Terminal(io.StringIO):
    """What takes text as a terminal does, and shows it."""

    def isatty(self) -> bool:
        return True

    def screen(self) -> list[str]:
        """What stands there in the end: after a carriage return text is written over."""
        lines = []
        for line in self.getvalue().split("\n"):
            row = ""
            for text in line.split("\r"):
                row = text + row[len(text) :]
            lines.append(row.rstrip())
        return lines


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "60")
    return Terminal()


class Clocked(Progress):
    """Progress at times that a test says; what it writes goes nowhere, if nothing else is said."""

    def __init__(self, total: int, *given: Any, stream: Any = None, **more: Any) -> None:
        self.now = 0.0
        stream = io.StringIO() if stream is None else stream
        super().__init__(total, *given, stream=stream, clock=lambda: self.now, **more)

    def at(self, now: float) -> Clocked:
        self.now = now
        return self


def test_the_time_left_is_what_the_share_done_took_so_far() -> None:
    course = Clocked(2)
    assert course.left() is None
    course.at(10.0).hear("a", "computing")
    assert course.at(15.0).left() is None
    course.end("a", well=True)
    # Half of all in 5 s.
    assert course.left() == pytest.approx(5.0)
    course.at(20.0).hear("b", "computing")
    course.at(29.0).hear("b", PartDone("the ninth level", 9, 20))
    # 0.45 of the second in 9 s.
    assert course.left() == pytest.approx(11.0)
    course.hear("b", PartDone("of another array", 2, 10))
    course.hear("b", "9 of 10, in words")
    assert course.left() == pytest.approx(11.0)
    assert course.said() == "1 of 2 done, 19 s, about 11 s left"
    course.at(40.0).end("b", well=True)
    assert course.left() == 0.0


def test_what_experiments_are_expected_to_take_counts_before_they_begin() -> None:
    course = Clocked(3, {"a": 2.0, "zoom": 100.0, "b": 1.0})
    assert course.left() is None
    course.hear("a", "computing")
    assert course.left() == pytest.approx(103.0)
    # It takes twice as long as expected, and so will the others.
    course.at(4.0).end("a", well=True)
    assert course.left() == pytest.approx(202.0)
    course.hear("zoom", "computing")
    assert course.at(54.0).left() == pytest.approx(152.0)
    # What takes longer than expected and says nothing has no time left.
    assert course.at(260.0).left() is None
    assert course.said() == "1 of 3 done, 4 min"
    # A twentieth of it in 60 s: its own pace and what is expected count alike.
    course.at(64.0).hear("zoom", PartDone("level", 1, 20))
    assert course.left() == pytest.approx(0.95 * (1200 + 200) / 2 + 2)


def test_the_time_left_learns_from_late_parts_more_than_from_early_ones() -> None:
    """Tables first, then a part a second: half-way the rest takes what late parts take."""
    course = Clocked(1, {"a": 10.0})
    course.hear("a", "computing")
    for done in range(1, 51):
        course.at(49.0 + done).hear("a", PartDone("part", done, 100))
    # By the mean of all parts it would be 99 s, by what was expected 5 s.
    assert course.left() == pytest.approx(50.0, rel=0.1)


def test_several_at_a_time_share_what_is_left() -> None:
    course = Clocked(4, dict.fromkeys("abcd", 10.0), 2)
    for name in "ab":
        course.hear(name, "computing")
    assert course.left() == pytest.approx(20.0)
    course.at(10.0).end("a", well=True)
    assert course.left() == pytest.approx(10.0)
    assert course.said().startswith("1 of 4 done, 10 s, about ")


def test_what_is_soon_over_says_nothing(terminal: Terminal) -> None:
    for stream, said in ((io.StringIO(), "a: at last\n"), (terminal, "a: at last")):
        shown = Clocked(1, stream=stream, patience=2.0)
        shown.hear("a", "computing")
        assert not stream.getvalue()
        shown.at(2.5).hear("a", "at last")
        assert said in stream.getvalue()


def test_a_terminal_keeps_the_last_line_of_each(terminal: Terminal) -> None:
    shown = Clocked(2, stream=terminal)
    shown.tell("x: up to date")
    for name in "ab":
        shown.hear(name, "computing, with a long line that does not fit into the width")
        assert len(terminal.screen()[-1]) < 60
        assert terminal.screen()[-1].startswith(f"[{'ab'.index(name)} of 2 done")
        shown.hear(name, PartDone("written", 1, 2))
        assert terminal.screen()[-1].endswith(f"{name}: written")
        shown.end(name, well=True)
    assert terminal.screen() == ["x: up to date", "a: written", "b: written", ""]
    # None wraps, with the blanks that write over the rest of a longer one.
    assert max(map(len, re.split("[\r\n]", terminal.getvalue()))) < 60


def test_room_is_made_for_others_and_what_failed_or_was_interrupted_leaves_no_line(
    terminal: Terminal,
) -> None:
    shown = Clocked(2, stream=terminal)
    shown.hear("a", "computing")
    shown.end("a", well=False)
    assert terminal.screen() == [""]
    with contextlib.suppress(KeyboardInterrupt), shown:
        shown.hear("b", "computing")
        raise KeyboardInterrupt
    terminal.write("rigidpend: words\n")
    assert terminal.screen() == ["rigidpend: words", ""]


LINES = "a: computing\na: at last\n"
TIMED = "".join(f"    2.50 s  {x}\n" for x in ("planned", "a: computing", "a: at last"))


@pytest.mark.parametrize(
    ("options", "well", "said"),
    [
        ({}, True, f"{LINES}1 of 2 done, 4 s, about 4 s left\n"),
        ({}, False, LINES),
        ({"quiet": True}, True, ""),
        ({"verbose": True}, False, TIMED),
    ],
)
def test_elsewhere_every_line_is_plain_and_a_failure_says_nothing_of_what_is_left(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch, options: Any, well: bool, said: str
) -> None:
    """Verbose has details and times, and quiet nothing; a dumb terminal cannot go back."""
    monkeypatch.setenv("TERM", "dumb")
    with Clocked(2, stream=terminal, **options).at(2.5) as shown:
        shown.tell("planned", detail=True)
        shown.hear("a", "computing")
        shown.hear("a", "at last")
        shown.at(6.5).end("a", well=well)
    assert terminal.getvalue() == said


def test_a_log_has_no_word_on_what_is_left_where_nothing_tells() -> None:
    file = io.StringIO()
    with Clocked(2, stream=file) as shown:
        shown.hear("b", "computing")
        shown.at(4.0).end("a", well=True)
    assert file.getvalue() == "b: computing\n"


def test_a_log_is_told_of_parts_now_and_then_and_of_the_last() -> None:
    log = io.StringIO()
    shown = Clocked(1, stream=log)
    shown.at(8.0).hear("a", "continues from 2 finished parts")
    # The finished ones come at once.
    for at in (8.1, 8.2, 10.0, 11.9, 12.1, 14.0, 14.2, 15.0):
        shown.at(at).hear("a", PartDone(f"part at {at}", round(10 * at), 150))
    assert re.findall(r"part at ([\d.]+)", log.getvalue()) == ["10.0", "12.1", "14.2", "15.0"]


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


def test_a_table_is_aligned_on_a_terminal_and_escaped_in_markdown() -> None:
    assert list(wording.terminal(TABLE)) == [
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


@pytest.mark.parametrize(
    ("write", "value", "text"),
    [
        *((seconds, 1.0, "1 s"), (seconds, 0.0999, "99.9 ms"), (seconds, 1.5e-6, "1.5 us")),
        *((seconds, 2e-9, "0.002 us"), (seconds, 1234.0, "1,234 s")),
        *((seconds, math.inf, "-"), (seconds, math.nan, "-"), (times, math.inf, "-")),
        *((duration, 0.4, "0 s"), (duration, 99.4, "99 s"), (duration, 100, "2 min")),
        *((duration, 5400, "90 min"), (duration, 9000, "2.5 h")),
        *((times, 0.9555, "0.956"), (times, 2285.7, "2,286")),
    ],
)
def test_times_have_units_and_ratios_three_digits(
    write: Callable[[float], str], value: float, text: str
) -> None:
    assert write(value) == text


def test_one_thing_is_counted_without_a_plural() -> None:
    assert [counted(n, "orbit") for n in (0, 1, 2)] == ["0 orbits", "1 orbit", "2 orbits"]
