"""Words for people: progress and the time that is left, tables of text, numbers."""

import contextlib
import errno
import io
import math
import os
import re
import sys
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from rigidpend.machine import progress, wording
from rigidpend.machine.progress import PartDone, Progress, duration
from rigidpend.machine.wording import Column, Table, columns, markdown, seconds, times


class Terminal(io.StringIO):
    """A stderr that takes text as a terminal does, and shows it."""

    width = 70

    def isatty(self) -> bool:
        return True

    def fileno(self) -> int:
        return 2

    def screen(self) -> list[str]:
        """What stands there: tqdm covers with blanks what it writes over."""
        return [line.split("\r")[-1].rstrip() for line in self.getvalue().split("\n")]


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The time of the display, and of tqdm: as a test says."""
    clock = SimpleNamespace(now=0.0)
    for name in ("rigidpend.machine.progress.time", "tqdm.std.time"):
        monkeypatch.setattr(name, lambda: clock.now)
    return clock


@pytest.fixture
def log(capsys: pytest.CaptureFixture[str]) -> Callable[[], str]:
    """What is new on stderr, which is no terminal."""
    return lambda: capsys.readouterr().err


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(progress, "PERIOD", 0.01)
    made = Terminal()
    monkeypatch.setattr(os, "get_terminal_size", lambda _: os.terminal_size((made.width, 24)))
    return made


def test_the_time_left_is_estimated_from_shares_by_what_experiments_are_expected_to_take(
    log: Callable[[], str], clock: SimpleNamespace
) -> None:
    """Here a takes twice as long as expected, and so will the rest of the others."""
    shown = Progress(3, {"a": 2.0, "b": 5.0}, 2)
    shown.hear("a", "computing")
    clock.now = 4.0
    shown.end("a", well=True)
    assert log().endswith("[25 %, 00:04, 00:12 left] 1 of 3 done\n")
    clock.now = 10.0
    shown.hear("b", PartDone("part 3 of 5", 3, 5))
    assert log() == "[62 %, 00:10, 00:06 left] 1 of 3 done; b: part 3 of 5\n"
    # The share of another array in it, which takes nothing back.
    clock.now = 14.0
    shown.hear("b", PartDone("part 1 of 5", 1, 5))
    assert log() == ""


def test_at_the_end_no_time_is_left_and_none_less_than_none(
    log: Callable[[], str], clock: SimpleNamespace
) -> None:
    """The whole is a sum of doubles, which may be a rounding less than what is done."""
    shown = Progress(1, {"a": 0.9})
    for clock.now in (12.0, 24.0):
        shown.hear("a", PartDone("part", clock.now, 24))
    assert log().splitlines()[-1].startswith("[100 %, 00:24, 00:00 left]")


def test_the_last_line_in_a_log_is_what_the_last_experiment_says(
    log: Callable[[], str], clock: SimpleNamespace
) -> None:
    shown = Progress(2)
    for clock.now, name in ((4.0, "a"), (9.0, "b")):
        shown.hear(name, "written")
        shown.end(name, well=True)
    first, second, last = log().splitlines()
    assert (first, last) == ("a: written", "b: written")
    assert second == "[50 %, 00:04, 00:04 left] 1 of 2 done"


def test_finished_parts_of_an_earlier_run_tell_nothing_of_the_pace(
    log: Callable[[], str], clock: SimpleNamespace
) -> None:
    shown = Progress(1)
    clock.now = 1.0
    shown.hear("a", PartDone("part", 90, 100))
    clock.now = 11.0
    shown.hear("a", PartDone("part", 91, 100))
    assert log() == "[91 %, 00:11, 01:29 left] 0 of 1 done; a: part\n"


def test_a_notebook_can_replace_a_line_as_a_terminal_can(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not progress.changes()
    monkeypatch.setitem(sys.modules, "ipykernel", sys)
    assert progress.changes()


def test_what_is_soon_over_says_nothing(log: Callable[[], str], clock: SimpleNamespace) -> None:
    shown = Progress(1, patient=True)
    clock.now = 29.0
    shown.hear("a", "computing")
    shown.hear("a", PartDone("part", 1, 9))
    assert log() == ""
    clock.now = 31.0
    shown.hear("a", "at last")
    assert log() == "a: at last\n"


def test_a_log_is_told_of_parts_now_and_then(
    log: Callable[[], str], clock: SimpleNamespace
) -> None:
    with Progress(1) as shown:
        shown.hear("a", "computing")
        for at in (0.2, 2.5, 2.6, 4.4, 4.6, 9.0):
            clock.now = at
            shown.hear("a", PartDone(f"part at {at}", at, 10))
    written = log()
    assert re.findall(r"part at ([\d.]+)", written) == ["2.5", "4.6", "9.0"]
    assert "\r" not in written


LINES = "a: computing\na: at last\n"
TIMED = "".join(f"    2.50 s  {x}\n" for x in ("planned", "a: computing", "a: part", "a: at last"))


@pytest.mark.parametrize(
    ("how", "said"), [({}, LINES), ({"quiet": 1}, ""), ({"verbose": 1}, TIMED)]
)
def test_a_dumb_terminal_has_plain_lines_verbose_all_with_their_times_and_quiet_none(
    terminal: Terminal, clock: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, how: Any, said: str
) -> None:
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr(sys, "stderr", terminal)
    with Progress(1, **how) as shown:
        clock.now = 2.5
        shown.tell("planned", detail=True)
        for line in ("computing", PartDone("part", 0, 2), "at last"):
            shown.hear("a", line)
        shown.end("a", well=False)
    assert terminal.getvalue().partition("[")[0] == said
    # To its end, however wide the page is.
    long = "a part with a name that is as long as the page is wide"
    shown = Progress(1, {"a": 8.0}, **how)
    clock.now = 5.0
    shown.hear("a", PartDone(long, 1, 2))
    assert terminal.getvalue().endswith(f"{long}\n" if "quiet" not in how else "")


def waits_for(text: str, terminal: Terminal) -> None:
    deadline = time.monotonic() + 20
    while text not in terminal.screen()[-1]:
        assert time.monotonic() < deadline, terminal.screen()
        time.sleep(0.01)


def test_a_terminal_has_one_line_that_changes_and_keeps_the_last_of_what_ended_well(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", terminal)
    shown = Progress(3)
    with contextlib.suppress(KeyboardInterrupt), shown:
        shown.tell("x: up to date")
        for name, well in (("a", True), ("b", False), ("c", True)):
            # Made narrower meanwhile.
            terminal.width -= 5
            shown.hear(name, "computing, with a long line that does not fit into the width")
            waits_for(f"done; {name}: computing", terminal)
            assert len(terminal.screen()[-1]) < terminal.width
            shown.hear(name, PartDone("written", 1, 2))
            waits_for(f"{'abc'.index(name)} of 3 done; {name}: written", terminal)
            if name == "c":
                raise KeyboardInterrupt
            shown.end(name, well=well)
            shown.clear()
    assert terminal.screen() == ["x: up to date", "a: written", ""]
    # None wraps, with the blanks that write over the rest of a longer one.
    assert max(map(len, re.split("[\r\n]", terminal.getvalue()))) < 70


@pytest.mark.parametrize(("at_once", "whole"), [(2, " of about 4 s"), (0, "")])
def test_a_whole_time_is_told_until_one_is_learned_where_it_is_known_how_many_go_side_by_side(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch, at_once: int, whole: str
) -> None:
    monkeypatch.setattr(sys, "stderr", terminal)
    with Progress(2, {"a": 2.0, "b": 6.0}, at_once) as shown:
        shown.hear("a", "computing")
        waits_for(f"[0 %{whole}, 00:00, ? left] 0 of 2 done", terminal)
        shown.hear("a", PartDone("part", 1, 2))
        waits_for("[12 %, 00:00, ", terminal)


def test_work_that_ends_before_its_first_part_leaves_no_line(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", terminal)
    with Progress(1) as shown:
        shown.hear("a", "computing")
        waits_for("a: computing", terminal)
    assert terminal.screen() == [""]


@pytest.mark.parametrize(("number", "ends"), [(errno.ENOSPC, False), (errno.EPIPE, True)])
def test_a_full_disk_loses_messages_and_a_reader_that_ended_is_told_of(
    monkeypatch: pytest.MonkeyPatch, number: int, ends: bool
) -> None:
    class Broken(io.StringIO):
        def write(self, text: str) -> int:
            raise OSError(number, "failed")

    monkeypatch.setattr(sys, "stderr", Broken())
    with pytest.raises(BrokenPipeError) if ends else contextlib.nullcontext(), Progress(1) as shown:
        shown.hear("a", "computing")


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
