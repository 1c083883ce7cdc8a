"""`rigidpend run`: compute experiments."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rigidpend.cli.common import (
    DONE,
    check_name,
    check_scheduler,
    exit_code,
    folder_of,
    guarded,
    print_json,
    say,
    sentence,
    settle_warnings,
)
from rigidpend.cli.options import JOBS, JSON, NAMES, OUT, SCHEDULER, SETTINGS, SWEEPS
from rigidpend.config.catalogue import resolve

if TYPE_CHECKING:
    from rigidpend.machine.progress import Progress
    from rigidpend.runs.loading import LoadedConfig
    from rigidpend.runs.logs import Logs
    from rigidpend.runs.runner import Plan, State

CLUSTERED = 32
"""Configs at a time that a cluster computes: each takes a thread here, which waits."""
LONG = 1.0
"""Seconds of a config that is worth a process, which takes a third of one to begin."""


@dataclass
class RunOutcome:
    """Outcome of one config in a run; a part of the document of ``--json``."""

    name: str
    status: str
    """One of: up to date, planned, computed, failed, interrupted, not run."""
    experiment: str
    reason: str | None = None
    """The reason for which it is computed."""
    engine: str | None = None
    config_hash: str | None = None
    code_hash: str | None = None
    file: str | None = None
    log: str | None = None
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
@click.option("--force", is_flag=True, help="Compute even what is up to date.")
@click.option(
    "-n", "--dry-run", is_flag=True, help="Only print what would be computed, and the reason."
)
@click.option("-k", "--keep-going", is_flag=True, help="Go on with the next config when one fails.")
@click.option("-q", "--quiet", is_flag=True, help="Print errors only.")
@click.option("-v", "--verbose", is_flag=True, help="Print more: times, hashes, files.")
@JSON
@guarded
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
    up to date is left alone; an interrupted run is resumed. FOLDER/NAME.log holds the messages
    of the last run. A result RESULT.h5 in place of a name is computed again where it is, by the
    config in it.

    With --sweep, or the section sweep of a config, there is a result for each combination of
    values, side by side as far as --jobs goes; its name tells them: FOLDER/fig4_mu=1e-3.h5.

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
    from rigidpend.machine import progress
    from rigidpend.runs import runner
    from rigidpend.runs.logs import Logs

    paths = resolve(names, folder)
    check_name(name, names, paths)
    known: dict[Path, State] = {}
    if not (force or sweeps or name):
        found = {x: runner.recalled(x, folder_of(x, folder), settings) for x in paths}
        known = {x: state for x, state in found.items() if state and not state.reason}
    members = _loaded([x for x in paths if x not in known], settings, sweeps, name)
    check_scheduler(scheduler)
    named: list[tuple[Path, LoadedConfig | State]] = []
    for x in paths:
        named += [(x, known[x])] if x in known else [(x, each) for each in members[x]]
    _check_twins([(folder_of(x, folder) / each.name, x) for x, each in named])
    planned = [_plan(each, x, folder, settings, force, keep_going) for x, each in named]
    outcomes = [outcome for _, outcome, _ in planned]
    code = max((code for *_, code in planned), default=DONE)
    waiting = [(plan, outcome) for plan, outcome, _ in planned if plan and plan.reason]
    expected = {x.name: cost for plan, x in waiting if (cost := runner.expected_seconds(plan))}
    # A cluster takes configs as they come.
    at_once = CLUSTERED if scheduler else jobs
    if len(paths) > 1 and not scheduler:
        at_once = _at_once([expected.get(x.name, 0.0) for _, x in waiting], jobs)
    at_once = min(len(waiting), at_once)
    shown = progress.Progress(
        len(waiting), expected, at_once, start=begun, quiet=quiet, verbose=verbose
    )
    try:
        with shown:
            shown.tell(f"planned in {time.perf_counter() - begun:.2f} s", detail=True)
            for outcome in outcomes:
                _tell_plan(outcome, shown, dry_run, expected.get(outcome.name))
            if not dry_run:
                targets = {planned.config.name: planned.target for planned, _ in waiting}
                logs = Logs(targets, shlex.join(["rigidpend", *sys.argv[1:]]))
                runs = Runs(shown, logs, expected, jobs, at_once, scheduler, keep_going)
                code = max(code, runs.compute(waiting))
    finally:
        if as_json:
            print_json([asdict(outcome) for outcome in outcomes])
    sys.exit(code)


def _at_once(expected: Sequence[float], jobs: int) -> int:
    """Number of configs side by side, by their seconds: so that none outlasts all the others.

    Short ones go one after the other, each with all threads.
    """
    longest = max(expected, default=0.0)
    return max(1, min(jobs, int(sum(expected) / longest))) if longest > LONG else 1


def _check_twins(named: Sequence[tuple[Path, Path]]) -> None:
    """Refuse configs of two files whose results would have one place."""
    first: dict[str, tuple[Path, Path]] = {}
    for target, path in named:
        known, twin = first.setdefault(str(target).casefold(), (target, path))
        if twin != path:
            same = "" if known == target else ", for some systems do not tell capitals"
            where = f"would both be stored as {target.name}.h5{same}"
            raise click.UsageError(f"{twin} and {path} {where}")


def _loaded(
    paths: Sequence[Path], settings: Sequence[str], sweeps: Sequence[str], name: str | None
) -> dict[Path, Sequence[LoadedConfig]]:
    """Configs of some files, by the file."""
    if not paths:
        return {}
    from rigidpend.runs import loading

    return {x.path: x.members for x in loading.load_groups(paths, settings, sweeps, name)}


def _plan(
    config: LoadedConfig | State,
    path: Path,
    folder: Path,
    settings: Sequence[str],
    force: bool,
    keep_going: bool,
) -> tuple[Plan | None, RunOutcome, int]:
    """Decide whether a config is to be run; failing that, return the failure and its exit code.

    A state that was recalled says that there is nothing to do.
    """
    from rigidpend.runs import runner

    outcome, plan = RunOutcome(config.name, "up to date", config.experiment), None
    place = folder_of(path, folder)
    try:
        if isinstance(config, runner.State):
            state = config
        elif force:
            state = plan = runner.plan(config, place, force=True)
        else:
            state = plan = runner.plan_kept(config, path, place, settings)
    except Exception as error:
        if not keep_going:
            raise
        outcome.status, outcome.error = "failed", sentence(error)
        say(f"rigidpend: {outcome.error}")
        return None, outcome, exit_code(error)
    outcome.file = str(state.target)
    outcome.engine = state.fingerprint["engine"]
    outcome.config_hash = state.fingerprint["config_hash"]
    outcome.code_hash = state.fingerprint["code_hash"]
    if state.reason:
        outcome.status, outcome.reason = "planned", state.reason
    return plan, outcome, DONE


def _tell_plan(outcome: RunOutcome, shown: Progress, dry_run: bool, seconds: float | None) -> None:
    from rigidpend.machine.progress import duration

    if outcome.status == "up to date":
        shown.tell(f"{outcome.name}: {outcome.file} is up to date")
    elif dry_run:
        cost = f", about {duration(max(1.0, seconds))}" if seconds else ""
        shown.tell(f"{outcome.name}: would compute ({outcome.reason}), {outcome.engine}{cost}")
    if outcome.status == "failed":
        return
    hashes = f"config {outcome.config_hash}, code {outcome.code_hash}"
    shown.tell(f"{outcome.name}: {outcome.experiment}, {hashes}", detail=True)


@dataclass
class Runs:
    """Runs of planned configs, by threads of this machine or by a cluster."""

    shown: Progress
    logs: Logs
    expected: dict[str, float]
    """Seconds that configs take, by name, as far as they are known."""
    jobs: int
    """Threads in all."""
    at_once: int
    """Configs at a time."""
    scheduler: str | None
    """Address of a cluster; None for this machine."""
    keep_going: bool
    code: int = DONE
    """Worst exit code so far."""

    def compute(self, waiting: Sequence[tuple[Plan, RunOutcome]]) -> int:
        """Compute the planned configs, so many at a time; return the worst exit code."""
        from rigidpend.machine import workers

        for _, outcome in waiting:
            outcome.status = "not run"
        if self.at_once > 1:
            # What is long and begins last would end alone.
            waiting = sorted(waiting, key=lambda pair: -self.expected.get(pair[1].name, 0.0))
        workers.side_by_side(self._follow, (), False, waiting, self.at_once)
        return self.code

    def _follow(self, pair: tuple[Plan, RunOutcome]) -> None:
        """Compute one config, unless one has failed before."""
        planned, outcome = pair
        if self.code != DONE and not self.keep_going:
            return
        name, begun = outcome.name, time.perf_counter()
        outcome.status = "interrupted"
        try:
            self._by_its_means(planned, name)
            outcome.status = "computed"
        except Exception as error:  # noqa: BLE001
            self.code, outcome.status = max(self.code, exit_code(error)), "failed"
            outcome.error = sentence(error, lambda it: self.logs.failure(name, it))
            self.logs.hear(name, f"failed: {outcome.error}")
            self.shown.clear()
            say(f"rigidpend: {name}: {outcome.error}")
        finally:
            outcome.seconds = round(time.perf_counter() - begun, 3)
            log = self.logs.path(name)
            outcome.log = str(log) if log else None
        self.shown.end(name, well=outcome.status == "computed")

    def _by_its_means(self, planned: Plan, name: str) -> None:
        """Compute one config here, on a cluster, or in a process of its own if it is long."""
        from rigidpend.machine import files, workers
        from rigidpend.runs import runner

        def hear(text: str) -> None:
            self.logs.hear(name, text)
            self.shown.hear(name, text)

        jobs = max(1, self.jobs // self.at_once)
        # Most of a long run is Python's own work, which holds the interpreter.
        apart = self.at_once > 1 and self.expected.get(name, 0.0) > LONG
        if self.scheduler or not apart:
            runner.follow(planned, jobs=jobs, say=hear, scheduler=self.scheduler)
            return
        try:
            workers.apart(_followed, (planned, jobs), hear)
        except BaseException:
            # A process that is ended may be writing.
            files.sweep(planned.target)
            raise


def _followed(planned: Plan, jobs: int, say: Callable[[str], None]) -> None:
    """Compute one config in this process, which is its own."""
    from rigidpend.runs import runner

    settle_warnings()
    runner.follow(planned, jobs=jobs, say=say)
