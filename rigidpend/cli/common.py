"""Shared pieces of the commands: exit codes, error messages, tables."""

import contextlib
import json
import math
import os
import re
import shutil
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import click

from rigidpend.config.catalogue import resolve, with_remedy
from rigidpend.machine import signals, wording

DONE, FAILED, MISUSED, ABSENT, INTERNAL = 0, 1, 2, 3, 4
"""Exit codes of the commands.

In this order: done or up to date; failed or different; wrong usage or config; something needed is
absent; an internal error."""
LONGEST = 200
"""Largest number of characters of a word, such as a path, that a message shows."""
OWED = "rigidpend.owed"
"""Key in a command's context for a document of ``--json`` that is still to be printed."""

KINDS = {
    "Absent": ABSENT,
    "ConfigError": MISUSED,
    "ParameterError": MISUSED,
    "ExactError": MISUSED,
    "EngineError": ABSENT,
    "StoreError": FAILED,
    "WorkerError": FAILED,
    "UnknownExperiment": FAILED,
    "NoChange": FAILED,
    "Contradiction": FAILED,
    "MemoryError": FAILED,
    # The package's own errors mean a failed computation; Python's mean a faulty program.
    "ZeroDivisionError": INTERNAL,
    "OverflowError": INTERNAL,
    "FloatingPointError": INTERNAL,
    "ArithmeticError": FAILED,
    # No space, no permission, a name that is too long: refusals by the system are not our faults.
    "OSError": FAILED,
}
"""Exit code of a class of errors and of the classes derived from it.

Classes are given by name, because importing all of them would take longer than many commands."""


def failed(ctx: click.Context, error: BaseException) -> NoReturn:
    """End a command after an error: with a sentence, an exit code, and the document it owes."""
    if isinstance(error, signals.Stopped | KeyboardInterrupt):
        code, said = signals.conclude(signals.came() or signal.SIGINT, say)
    else:
        code = exit_code(error)
        # stdout itself may have failed, as on a full disk, and would fail again when flushed.
        if isinstance(error, OSError):
            drop(sys.stdout)
        said = sentence(error)
        # A complaint about a config begins with its file and line, without a program's name. A
        # report that shows no result tells a line of each.
        named = said if code == MISUSED else "\n".join(f"rigidpend: {x}" for x in said.split("\n"))
        say(named)
    print_failure(ctx, said, code)
    sys.exit(code)


def print_failure(ctx: click.Context, said: str, code: int) -> None:
    """Print the document of a command that failed before it could print its own."""
    if ctx.meta.get(OWED):
        print_json({"error": said, "exit_code": code})


def exit_code(error: BaseException) -> int:
    """Exit code of an error, by its class."""
    # A missing module of our own means a broken installation, not an extra to be installed.
    if isinstance(error, ImportError):
        return ABSENT if wording.library(error) else INTERNAL
    # The nearest known class decides, so that a class may differ from the one it derives from.
    names = (kind.__name__ for kind in type(error).__mro__)
    return next((KINDS[name] for name in names if name in KINDS), INTERNAL)


def sentence(error: BaseException, log: Callable[[BaseException], Path] | None = None) -> str:
    """Sentence on an error; an internal error goes to a log with its traceback."""
    code = exit_code(error)
    if isinstance(error, MemoryError):
        return "not enough memory; fewer orbits or fewer --jobs need less"
    # On a full disk Python 3.11 and 3.12 may leave truncated files of compiled code.
    if isinstance(error, EOFError) and "marshal" in str(error):
        return f"{error}: a full disk cut a file short; remove the folders __pycache__ of rigidpend"
    # Errors of the package say themselves what to do.
    if type(error) is ModuleNotFoundError and code == ABSENT:
        return f"{error.name} is needed and not installed"
    if type(error) is ImportError and code == ABSENT:
        lacking = wording.library(error)
        return f"{lacking} cannot be loaded ({wording.short(error)}): install it anew"
    if isinstance(error, OSError):
        named = f"{str(error.filename)[:LONGEST]}: " if error.filename else ""
        if not named and isinstance(error, FileNotFoundError):
            # As `os.getcwd` raises it.
            named = "the current folder is gone, change to another one: "
        return f"{named}{error.strerror or error}"
    if code != INTERNAL:
        if getattr(error, "file", None) is None:
            return brief(str(error))
        return brief(with_remedy(error))  # type: ignore[arg-type]
    from rigidpend.runs.logs import elsewhere

    said = f"internal error: {error!r}; please report it"
    try:
        return f"{said} with {(log or elsewhere)(error)}"
    except OSError as full:
        return f"{said}; no log could be written: {full.strerror}"


def brief(said: str) -> str:
    """A message, with the middle of words of more than `LONGEST` characters left out."""
    return re.sub(rf"\S{{{LONGEST + 1},}}", lambda word: f"{word[0][:60]}...{word[0][-60:]}", said)


def configs_of(names: Sequence[str], folder: Path, name: str | None) -> list[Path]:
    """Files of named configs; a name for the result is accepted only with a single config."""
    paths = resolve(tuple(names), folder)
    if name is not None and max(len(names), len(paths)) > 1:
        raise click.UsageError("--name is for one config; several keep their names")
    return paths


def folder_of(path: Path, folder: Path) -> Path:
    """Folder of a config's result: the folder of results, or that of a named RESULT.h5."""
    return path.parent if path.suffix == ".h5" else folder


def say(text: str, of: str = "") -> None:
    """Write a message to stderr, so that stdout has data only; on a full disk it is lost.

    It begins with the name `of` what it is about, if there is one.
    """
    try:
        click.echo(f"{of}: {text}" if of else text, err=True)
    except BrokenPipeError:
        raise
    except OSError:
        pass


def settle_stderr() -> None:
    """Drop messages that a full disk refused, which would fail again when Python ends."""
    try:
        sys.stderr.flush()
    except OSError:
        drop(sys.stderr)


def drop(stream: Any) -> None:
    """Redirect a stream to nowhere, because its unwritten rest would fail again at the end."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def print_json(document: Any) -> None:
    """Write the document of ``--json`` to stdout: arrays as lists, non-finite numbers as null."""
    click.get_current_context().meta[OWED] = False
    click.echo(json.dumps(_plain(document), indent=2, default=str))


def _plain(value: Any) -> Any:
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_table(rows: Sequence[Sequence[str]], margin: str = "") -> None:
    """Print rows in columns that fit the terminal, or 80 characters without a terminal."""
    for line in wording.columns(rows, shutil.get_terminal_size().columns, margin):
        click.echo(line)
