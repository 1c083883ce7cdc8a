"""`rigidpend run`: compute experiments."""

from __future__ import annotations

import os
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rigidpend.cli.common import DONE, configs_of, exit_code, folder_of, print_json, say, sentence
from rigidpend.cli.options import JOBS, JSON, NAMES, OUT, SCHEDULER, SETTINGS, SWEEPS
from rigidpend.machine.progress import Progress, duration

if TYPE_CHECKING:
    from rigidpend.runs.loading import LoadedConfig
    from rigidpend.runs.logs import Logs
    from rigidpend.runs.runner import Plan

CLUSTERED = 32
"""Number of configs at a time on a cluster: each takes a waiting thread here."""
LONG = 1.0
"""Seconds from which a config is worth a process, whose start takes a third of a second."""


@dataclass
class RunOutcome:
    """Outcome of one config in a run; a part of the document of ``--json``."""

    name: str
    status: str
    """One of: up to date, planned, computed, failed, interrupted, not run."""
    experiment: str
    reason: str | None = None
    """The reason to compute it."""
    engine: str | None = None
    config_hash: str | None = None
    code_hash: str | None = None
    file: Path | None = None
    log: Path | None = None
    seconds: float | None = None
    error: str | None = None


@click.command("run")
@NAMES
@SETTINGS
@SWEEPS
@click.option("--name", metavar="NAME", help="Name of the result, for one config.")
@OUT
@JOBS
@SCHEDULER
@click.option("--force", is_flag=True, help="Compute even if the result is up to date.")
@click.option(
    "-n", "--dry-run", is_flag=True, help="Only print what would be computed, and the reason."
)
@click.option("-k", "--keep-going", is_flag=True, help="Go on with the next config when one fails.")
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
@click.option("-v", "--verbose", is_flag=True, help="Print more: times, hashes, files.")
@JSON
def run_command(
    names: tuple[str, ...],
    settings: tuple[str, ...],
    sweeps: tuple[str, ...],
    name: str | None,
    folder: Path,
    jobs: int,
    scheduler: str | None,
    force: bool,
    dry_run: bool,
    keep_going: bool,
    quiet: bool,
    verbose: bool,
    as_json: bool,
) -> None:
    """Compute experiments and store their results.

    Results are FOLDER/NAME.h5. NAME is a config's name, a file, or all. A result that is
    up to date is not computed again; an interrupted run is resumed. FOLDER/NAME.log has the
    messages of the last run. A RESULT.h5 in place of a name is computed again where it is, from
    the config in it.

    With --sweep there is a result for each combination of values, computed in parallel as far as
    --jobs allows; its name contains them: FOLDER/fig4_mu=1e-3.h5.

    With --json stdout has, for each config, its status, reason, file, seconds and error.

    \b
    Examples:
      rigidpend run all
      rigidpend run all -n
      rigidpend run fig4 --set problem.n_symbols=6 --set numerics.engine=scipy
      rigidpend run fig1 fig2 --keep-going --quiet --json
      rigidpend run fig4 --set problem.mu=0.01 --name heavy
      rigidpend run fig4 --sweep problem.mu=1e-4,1e-3 --sweep problem.J1_0=1e-8,1e-6
      rigidpend run route_map --scheduler tcp://head:8786
    """
    begun = time.perf_counter()
    if quiet and verbose:
        raise click.UsageError("--quiet and --verbose exclude each other")
    from rigidpend.runs import loading
    from rigidpend.runs.logs import Logs

    paths = configs_of(names, folder, name)
    swept = loading.load_swept(paths, settings, sweeps, name)
    named = [(x, each) for x, some in zip(paths, swept, strict=True) for each in some]
    # Unlike Path.resolve it raises nothing at links that go around in a circle.
    _check_twins([(Path(os.path.realpath(folder_of(x, folder)), y.name), x) for x, y in named])
    runs = Runs(jobs, scheduler, keep_going)
    for x, each in named:
        runs.plan(each, folder_of(x, folder), force)
    at_once, expected = runs.at_once(len(paths)), runs.expected
    # Nobody knows how many configs a cluster has in progress: its workers come and go.
    side_by_side = 0 if scheduler else at_once
    shown = Progress(len(runs.waiting), expected, side_by_side, quiet=quiet, verbose=verbose)
    try:
        with shown:
            shown.tell(f"planned in {time.perf_counter() - begun:.2f} s", detail=True)
            for outcome in runs.outcomes:
                _tell_plan(outcome, shown, dry_run, expected.get(outcome.name))
            if not dry_run:
                targets = {outcome.name: plan.target for plan, outcome in runs.waiting}
                logs = Logs(targets, shlex.join(["rigidpend", *sys.argv[1:]]))
                runs.compute(at_once, shown, logs)
    finally:
        if as_json:
            print_json([asdict(outcome) for outcome in runs.outcomes])
    sys.exit(runs.code)


def _check_twins(named: Sequence[tuple[Path, Path]]) -> None:
    """Refuse two config files whose results would have the same path."""
    first: dict[str, tuple[Path, Path]] = {}
    for target, path in named:
        known, twin = first.setdefault(str(target).casefold(), (target, path))
        if twin != path:
            same = "" if known == target else ", because some systems ignore case"
            where = f"would both be stored as {target.name}.h5{same}"
            raise click.UsageError(f"{twin} and {path} {where}")


def _tell_plan(outcome: RunOutcome, shown: Progress, dry_run: bool, seconds: float | None) -> None:
    if outcome.status == "failed":
        return
    if outcome.status == "up to date":
        shown.tell(f"{outcome.name}: {outcome.file} is up to date")
    elif dry_run:
        cost = f", about {duration(max(1.0, seconds))}" if seconds else ""
        shown.tell(f"{outcome.name}: would compute ({outcome.reason}), {outcome.engine}{cost}")
    hashes = f"config {outcome.config_hash}, code {outcome.code_hash}"
    shown.tell(f"{outcome.name}: {outcome.experiment}, {hashes}", detail=True)


@dataclass
class Runs:
    """Configs that are planned one by one, then computed in parallel, here or by a cluster."""

    jobs: int
    """Number of threads for all configs together."""
    scheduler: str | None
    """Address of a cluster; None for this machine."""
    keep_going: bool
    outcomes: list[RunOutcome] = field(default_factory=list)
    waiting: list[tuple[Plan, RunOutcome]] = field(default_factory=list)
    """Configs that are still to be computed."""
    expected: dict[str, float] = field(default_factory=dict)
    """Expected seconds of a config, by name, as far as they are known."""
    code: int = DONE
    """Worst exit code so far."""

    def plan(self, config: LoadedConfig, folder: Path, force: bool) -> None:
        """Decide whether to run a config, and note the decision."""
        from rigidpend.runs import runner

        outcome = RunOutcome(config.name, "up to date", config.content.experiment)
        self.outcomes.append(outcome)
        try:
            planned = runner.plan(config, folder, force=force)
        except Exception as error:
            if not self.keep_going:
                raise
            say(f"rigidpend: {self._failed(outcome, error, None)}")
            return
        outcome.file = planned.target
        for key, value in planned.fingerprint.items():
            setattr(outcome, key, value)
        if planned.reason:
            outcome.status, outcome.reason = "planned", planned.reason
            self.waiting.append((planned, outcome))
            if cost := runner.expected_seconds(planned):
                self.expected[config.name] = cost

    def at_once(self, files: int) -> int:
        """Number of configs at a time: for several files so many that none outlasts all others.

        Short configs run one after the other, each with all threads. A cluster takes all in turn.
        """
        most = CLUSTERED if self.scheduler else self.jobs
        if files > 1 and not self.scheduler:
            longest = max(self.expected.values(), default=0.0)
            side_by_side = int(sum(self.expected.values()) / longest) if longest > LONG else 1
            most = max(1, min(most, side_by_side))
        return min(len(self.waiting), most)

    def compute(self, at_once: int, shown: Progress, logs: Logs) -> None:
        """Compute the planned configs, `at_once` at a time."""
        from rigidpend.machine import workers

        for _, outcome in self.waiting:
            outcome.status = "not run"
        if at_once > 1:
            # Longest first: a long config that begins last would run alone at the end.
            self.waiting.sort(key=lambda pair: -self.expected.get(pair[1].name, 0.0))
        given = at_once, shown, logs
        workers.side_by_side(self._follow, given, False, self.waiting, at_once)

    def _follow(
        self, pair: tuple[Plan, RunOutcome], at_once: int, shown: Progress, logs: Logs
    ) -> None:
        """Compute one config, unless one has failed before."""
        planned, outcome = pair
        if self.code != DONE and not self.keep_going:
            return
        name, begun = outcome.name, time.perf_counter()

        def hear(text: str) -> None:
            logs.hear(name, text)
            shown.hear(name, text)

        # Stays if a signal ends this thread before the config is computed or has failed.
        outcome.status = "interrupted"
        try:
            self._by_its_means(planned, at_once, hear)
            outcome.status = "computed"
        except Exception as error:  # noqa: BLE001
            said = self._failed(outcome, error, lambda it: logs.failure(name, it))
            logs.hear(name, f"failed: {said}")
            shown.clear()
            say(f"rigidpend: {name}: {said}")
        finally:
            outcome.seconds = round(time.perf_counter() - begun, 3)
            outcome.log = logs.path(name)
        # Of a run that goes no further the last line is why.
        if outcome.status == "computed" or self.keep_going:
            shown.end(name, well=outcome.status == "computed")

    def _by_its_means(self, planned: Plan, at_once: int, hear: Callable[[str], None]) -> None:
        """Compute one config here, on a cluster, or in a process of its own if it is long."""
        from rigidpend.machine import files, workers
        from rigidpend.runs import runner

        jobs = max(1, self.jobs // at_once)
        # A long run is mostly Python code, which holds the interpreter's lock.
        apart = at_once > 1 and self.expected.get(planned.config.name, 0.0) > LONG
        if self.scheduler or not apart:
            runner.follow(planned, jobs, hear, self.scheduler)
            return
        try:
            workers.apart(runner.follow, (planned, jobs), hear)
        except BaseException:
            # The process may have been ended while it was writing.
            files.remove_leftovers(planned.target, least_age=0.0)
            raise

    def _failed(
        self, outcome: RunOutcome, error: Exception, log: Callable[[BaseException], Path] | None
    ) -> str:
        """Note and report the failure of a config."""
        self.code = max(self.code, exit_code(error))
        outcome.status, outcome.error = "failed", sentence(error, log)
        return outcome.error
