"""The command line: thin functions; what is heavy is imported where it is used."""

from __future__ import annotations

import itertools
import sys
import tempfile
import traceback
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click

import rigidpend

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


def _guarded(command: Command) -> Command:
    """Turn what can go wrong into a sentence and an exit code."""

    @wraps(command)
    def guarded(*args: Any, **kwargs: Any) -> Any:
        try:
            return command(*args, **kwargs)
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except KeyboardInterrupt:
            _say("interrupted; finished results are kept")
            sys.exit(130)
        except Exception as error:
            code = _code(error)
            _say(str(error) if code == MISUSED else f"rigidpend: {_sentence(error, code)}")
            sys.exit(code)

    return guarded  # type: ignore[return-value]


def _code(error: Exception) -> int:
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


def _sentence(error: Exception, code: int) -> str:
    """What to say of an error; one of ours goes to a log with its traceback."""
    if code != INTERNAL:
        return str(error)
    with tempfile.NamedTemporaryFile("w", prefix="rigidpend-", suffix=".log", delete=False) as log:
        traceback.print_exception(error, file=log)
    return f"internal error: {error!r}; please report it with {log.name}"


def _say(text: str) -> None:
    """Words for people: on stderr, so that stdout holds data."""
    click.echo(text, err=True)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(rigidpend.__version__, prog_name="rigidpend")
def main() -> None:
    """Perturbed pendulum-like motions of a heavy rigid body: run, look, check.

    \b
    Examples:
      rigidpend list
      rigidpend run fig4
      rigidpend render fig4
      rigidpend run fig4 --set problem.J1_0=1e-10 --out /tmp/mine
    """


@main.command()
@NAMES
@SETTINGS
@OUT
@click.option("-j", "--jobs", type=click.IntRange(1), help="Threads; all processors if not given.")
@click.option("--force", is_flag=True, help="Compute even what is up to date.")
@_guarded
def run(
    names: tuple[str, ...],
    settings: tuple[str, ...],
    folder: Path,
    jobs: int | None,
    force: bool,
) -> None:
    """Compute experiments and store their results as FOLDER/NAME.h5.

    NAME is a config's name, a file, or all. What is up to date is left alone.

    \b
    Examples:
      rigidpend run all
      rigidpend run fig4 --set problem.n_symbols=30 --set numerics.engine=scipy
    """
    from rigidpend import config, runner, workers

    paths = config.names.resolve(names)
    for path, twin in itertools.combinations(paths, 2):
        if path.stem == twin.stem:
            raise click.UsageError(f"{path} and {twin} would both be stored as {path.stem}.h5")
    configs = [config.load(path, settings) for path in paths]
    plans = [runner.plan(loaded, folder, force=force) for loaded in configs]
    for planned in plans:
        if not planned.reason:
            _say(f"{planned.config.name}: {planned.target} is up to date")
    runner.run_all(
        [planned for planned in plans if planned.reason], jobs=jobs or workers.cores(), say=_say
    )


@main.command()
@NAMES
@OUT
@click.option(
    "--format",
    "suffix",
    type=click.Choice(["png", "svg", "pdf"]),
    default="png",
    show_default=True,
    help="Format of the figure.",
)
@_guarded
def render(names: tuple[str, ...], folder: Path, suffix: str) -> None:
    """Draw stored results as FOLDER/NAME.png.

    \b
    Examples:
      rigidpend render all
      rigidpend render fig4 --format pdf
    """
    from rigidpend import render as drawing
    from rigidpend.config import names as known

    for path in known.resolve(names):
        source = folder / f"{path.stem}.h5"
        if not source.is_file():
            _say(f"rigidpend: {source} is not there; call: rigidpend run {path.stem}")
            sys.exit(FAILED)
        target = source.with_suffix(f".{suffix}")
        drawing.render(source, target)
        _say(f"{path.stem}: {target} drawn")


@main.command("list")
@_guarded
def list_() -> None:
    """List the configs that can be named."""
    from rigidpend import config

    for name, path in config.names.known().items():
        try:
            click.echo(f"{name}\t{config.load(path).experiment}\t{path}")
        except config.ConfigError as error:
            click.echo(f"{name}\tcannot be used\t{path}")
            _say(str(error))


@main.command()
@click.argument("name", metavar="NAME|FILE.yaml")
@SETTINGS
@_guarded
def describe(name: str, settings: tuple[str, ...]) -> None:
    """Print a config's parameters with units, and what follows from them.

    \b
    Example:
      rigidpend describe fig4 --set problem.mu=0.01
    """
    from rigidpend import config, experiments

    for path in config.names.resolve((name,)):
        loaded = config.load(path, settings)
        click.echo(f"{loaded.name}: experiment {loaded.experiment}, {path}")
        rows = experiments.module(loaded.experiment).describe(loaded.content)
        name_width = max(len(row.name) for row in rows)
        value_width = max(len(row.value) for row in rows)
        for row in rows:
            click.echo(f"  {row.name:<{name_width}}  {row.value:<{value_width}}  {row.meaning}")


@main.command()
@NAMES
@click.option(
    "--reference",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results/reference"),
    show_default=True,
    help="Folder of the stored results.",
)
@click.option("-j", "--jobs", type=click.IntRange(1), help="Threads; all processors if not given.")
@_guarded
def verify(names: tuple[str, ...], reference: Path, jobs: int | None) -> None:
    """Compute experiments again and compare them by value with stored results.

    \b
    Example:
      rigidpend verify all
    """
    from rigidpend import config, runner, workers

    differing = False
    for path in config.names.resolve(names):
        loaded = config.load(path)
        stored = reference / f"{loaded.name}.h5"
        found = runner.verify(loaded, stored, jobs=jobs or workers.cores())
        differing |= bool(found)
        click.echo(f"{loaded.name}: {'differs from' if found else 'the same as in'} {stored}")
        for difference in found:
            click.echo(f"  {difference}")
    sys.exit(FAILED if differing else DONE)
