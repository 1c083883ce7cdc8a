"""What the commands share: exit codes, options, and how what goes wrong is said."""

from __future__ import annotations

import sys
import tempfile
import traceback
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click

DONE, FAILED, MISUSED, ABSENT, INTERNAL = 0, 1, 2, 3, 4
"""Exit codes: done or up to date, failed or different, usage or config, something needed is
absent, an error of ours. 130 is an interruption."""

Command = TypeVar("Command", bound=Callable[..., Any])

OUT = click.option(
    "--out",
    "folder",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results"),
    show_default=True,
    help="Folder of the results.",
)
NAMES = click.argument("names", nargs=-1, required=True, metavar="NAME|FILE.yaml...")
SETTINGS = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="a.b=VALUE",
    help="Override a value of the config; may be given again.",
)
JOBS = click.option(
    "-j", "--jobs", type=click.IntRange(1), help="Threads; all processors if not given."
)


def guarded(command: Command) -> Command:
    """Turn what can go wrong into a sentence and an exit code."""

    @wraps(command)
    def run(*args: Any, **kwargs: Any) -> Any:
        try:
            return command(*args, **kwargs)
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except KeyboardInterrupt:
            say("interrupted; finished results are kept")
            sys.exit(130)
        except Exception as error:
            code = exit_code(error)
            say(str(error) if code == MISUSED else f"rigidpend: {_sentence(error, code)}")
            sys.exit(code)

    return run  # type: ignore[return-value]


def exit_code(error: Exception) -> int:
    """The exit code that an error's kind stands for."""
    kinds = {
        "ConfigError": MISUSED,
        "BodyError": MISUSED,
        "ProblemError": MISUSED,
        "ExactError": MISUSED,
        "EngineError": ABSENT,
        "StoreError": FAILED,
        "OtherVersion": FAILED,
        "NoChange": FAILED,
        "ArithmeticError": FAILED,
    }
    return kinds.get(type(error).__name__, INTERNAL)


def say(text: str) -> None:
    """Words for people: on stderr, so that stdout holds data."""
    click.echo(text, err=True)


def _sentence(error: Exception, code: int) -> str:
    """What to say of an error; one of ours goes to a log with its traceback."""
    if code != INTERNAL:
        return str(error)
    with tempfile.NamedTemporaryFile("w", prefix="rigidpend-", suffix=".log", delete=False) as log:
        traceback.print_exception(error, file=log)
    return f"internal error: {error!r}; please report it with {log.name}"
