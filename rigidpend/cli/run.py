"""`rigidpend run`: compute experiments."""

from __future__ import annotations

import itertools
from pathlib import Path

import click

from rigidpend.cli.common import JOBS, NAMES, OUT, SETTINGS, guarded, say


@click.command("run")
@NAMES
@SETTINGS
@OUT
@JOBS
@click.option("--force", is_flag=True, help="Compute even what is up to date.")
@guarded
def command(
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
            say(f"{planned.config.name}: {planned.target} is up to date")
    runner.run_all(
        [planned for planned in plans if planned.reason], jobs=jobs or workers.cores(), say=say
    )
