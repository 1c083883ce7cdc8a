"""Mutation testing: change the code in one place at a time, and see whether a test fails.

A run draws a sample of all places of the package from a stated seed, makes each change in a copy of
the project and runs there, in processes of their own, the test file that mirrors the module, then
the quick tests of its folder and of all others, and at last the slow ones of the folder.

    python -m scripts.mutants --count 400 --seed 1 --processes 2
    python -m scripts.mutants --only rigidpend/routes/certified

Verdicts are kept, and not sought again: a run that was stopped goes on where it was. What is
declared in `tests/equivalent_mutants.yaml` is not run, and counts apart. `tests/MUTANTS.md` says
why this is no tool of others.
"""

import argparse
import compileall
import contextlib
import os
import queue
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from scripts.mutations import ROOT, Mutant, drawn, equivalent, mutants, source

BUILD = ROOT / "build" / "mutants"
OF_TEXT = tuple(f"tests/test_{name}.py" for name in ("imports", "labels", "mutants", "readme"))
"""Tests of the texts: they notice that a file is written anew, whatever it says."""
COPIED = ("rigidpend", "tests", "scripts", "docs", "configs", "results")
"""What a copy of the project has of its own; the rest it shares."""
OF_PEERS = ("cyrk_compiled",)
"""Methods of libraries that the tests do without."""
PICTURE = "tests/experiments/test_drawings.py::test_a_figure_is_that_of_the_gallery"
"""The test of what is drawn, with a case for each experiment."""
LIMIT = 180.0
"""Seconds after which tests are held against the code as it is."""
WIDE = 10
"""Times as many for tests of several files."""
KILLED, LATE, SURVIVED = "killed", "timeout", "survived"
OPEN, UNTOLD = "open", "untold"
"""What the nearest tests do not notice; what no verdict was found on, for tests fail without it."""


def files(below: str = "rigidpend") -> list[str]:
    """The files that are mutated."""
    target = ROOT / below
    found = target.rglob("*.py") if target.is_dir() else [target]
    return sorted(str(x.relative_to(ROOT)) for x in found if x.stem not in OF_PEERS)


class Verdict(NamedTuple):
    """What became of a mutant."""

    found: str
    by: str
    """The test that failed, or nothing."""
    seconds: float
    """Of processor time."""


class Desk:
    """Copies of the project in which mutants are made, one for each that works at a time.

    All of a copy's package is written anew by the tools that write mutants, so that a mutant
    differs from it by the change alone. A mutant has compiled code and return maps of its own, and
    begins with those of the user: what a mutated module compiles must not be found by the next
    one.
    """

    def __init__(self, folder: Path, copies: int, limit: float, *, quick: bool) -> None:
        self.free: queue.Queue[Path] = queue.Queue()
        self.limit, self.quick = limit, quick
        self.sound: dict[str, bool] = {}
        # As it is now, for others change it meanwhile.
        self.kept = folder / "kept"
        self.kept.mkdir(parents=True)
        mine = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "rigidpend"
        with contextlib.suppress(shutil.Error, FileNotFoundError):
            shutil.copytree(mine, self.kept / "rigidpend")
        for k in range(copies):
            self.free.put(copied(folder / str(k)))

    def judge(self, mutant: Mutant) -> Verdict:
        """The verdict of the tests on a mutant."""
        folder, begun = self.free.get(), _spent()
        target = folder / mutant.path
        before = target.read_text()
        try:
            target.write_text(source(before, mutant))
            found, by = self._verdict(folder, target, before, self._stages(mutant))
        finally:
            target.write_text(before)
            self.free.put(folder)
        return Verdict(found, by, _spent() - begun)

    def _stages(self, mutant: Mutant) -> list[tuple[list[str], float]]:
        """Tests to be asked, each lot after those before, with the seconds that they may take."""
        file = own(mutant)
        rest, wide = around(mutant, file), WIDE * self.limit
        beside = with_mark(rest, "not slow"), wide
        if self.quick:
            return [(with_mark(file, "not slow"), self.limit), beside]
        others = with_mark(["tests", *(f"--ignore={x}" for x in OF_TEXT)], "not slow")
        return [(file, self.limit), beside, (others, wide), (with_mark(rest, "slow"), wide)]

    def _verdict(
        self, folder: Path, target: Path, plain: str, stages: Sequence[tuple[list[str], float]]
    ) -> tuple[str, str]:
        mutated = target.read_text()

        def without(tests: Sequence[str], limit: float) -> bool:
            """Whether tests pass where the mutant is not."""
            target.write_text(plain)
            found = failing(folder, tests, self.kept, limit)
            target.write_text(mutated)
            return found == ""

        for tests, limit in stages:
            failed = self._asked(folder, tests, limit)
            while failed and failed not in self.sound:
                self.sound[failed] = without([failed], limit)
                if not self.sound[failed]:
                    failed = self._asked(folder, tests, limit)
            if failed is None:
                return (LATE if without(self._left(tests), limit / 2) else UNTOLD), ""
            if failed:
                return (KILLED if self.sound[failed] else UNTOLD), failed
        return (OPEN if self.quick else SURVIVED), ""

    def _asked(self, folder: Path, tests: Sequence[str], limit: float) -> str | None:
        return failing(folder, self._left(tests), self.kept, limit) if tests else ""

    def _left(self, tests: Sequence[str]) -> list[str]:
        """Tests without those that fail with no mutant."""
        return [*tests, *(f"--deselect={x}" for x, sound in self.sound.items() if not sound)]


def own(mutant: Mutant) -> list[str]:
    """The test file that mirrors the module, or its folder; of a drawing, that of its picture."""
    path = Path(mutant.path)
    if path.name == "draw.py":
        return [f"{PICTURE}[{path.parent.name}]"]
    folder = mirrored(mutant.path)
    files = folder / f"test_{path.stem}.py", folder.with_name(f"test_{folder.name}.py")
    return [str(file) for file in files if (ROOT / file).exists()][:1]


def with_mark(tests: Sequence[str], mark: str) -> list[str]:
    """Of some tests those that have a mark, or have it not, as pytest takes it."""
    return [*tests, "-m", mark] if tests else []


def mirrored(path: str) -> Path:
    """The folder of tests of a module."""
    return Path("tests") / Path(path).parent.relative_to("rigidpend")


def around(mutant: Mutant, before: Sequence[str]) -> list[str]:
    """All test files of the mirrored folder that were not run, or of the one above."""
    folder = ROOT / mirrored(mutant.path)
    while not any(folder.glob("test_*.py")):
        folder = folder.parent
    found = (str(x.relative_to(ROOT)) for x in sorted(folder.rglob("test_*.py")))
    return [x for x in found if x not in before and x not in OF_TEXT]


def failing(folder: Path, tests: Sequence[str], kept: Path, limit: float) -> str | None:
    """The first test that fails in a copy of the project, "" if none does, None without an end."""
    shutil.rmtree(folder / "cache", ignore_errors=True)
    shutil.copytree(kept, folder / "cache")
    plugins = ["no:cacheprovider", "no:xdist", "no:cov", "tests.unshrunk"]
    options = ["-x", "-q", "-rfE", "--tb=no", "--no-header"]
    options += [x for name in plugins for x in ("-p", name)]
    cache = {"XDG_CACHE_HOME": str(folder / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    process = subprocess.Popen(
        [sys.executable, "-m", "pytest", *options, *tests],
        cwd=folder, env={**os.environ, "PYTHONPATH": str(folder), **cache},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        said, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        # With all that it began.
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return None
    if process.returncode in (0, 5):
        return ""
    named = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", said, re.MULTILINE)
    return named[1] if named else tests[0]


def _spent() -> float:
    """Processor time of all processes of tests that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def copied(folder: Path) -> Path:
    """A copy of the project, to be mutated: its package written anew, all compiled."""
    folder.mkdir(parents=True)
    for path in ROOT.iterdir():
        if path.name in COPIED:
            shutil.copytree(path, folder / path.name, ignore=shutil.ignore_patterns("__pycache__"))
        elif path.name not in (".git", "build"):
            (folder / path.name).symlink_to(path)
    for path in (folder / "rigidpend").rglob("*.py"):
        path.write_text(source(path.read_text()))
    compileall.compile_dir(folder, quiet=1)
    # As pytest writes tests: by collecting them once.
    call = [sys.executable, "-m", "pytest", "--collect-only", "-qq", "-p", "no:cacheprovider"]
    env = {**os.environ, "PYTHONPATH": str(folder)}
    subprocess.run(call, cwd=folder, env=env, stdout=subprocess.DEVNULL, check=True)
    return folder


class Verdicts(dict[str, Verdict]):
    """The verdicts on mutants, by what they are called; kept in a file."""

    def __init__(self, kept: Path) -> None:
        super().__init__()
        self.kept = kept
        if kept.exists():
            rows = (x.split("\t") for x in kept.read_text().splitlines())
            self.update((name, Verdict(found, by, float(s))) for found, s, by, name in rows)

    def add(self, mutant: Mutant, verdict: Verdict) -> None:
        self[str(mutant)] = verdict
        self.kept.parent.mkdir(parents=True, exist_ok=True)
        with self.kept.open("a") as file:
            file.write(f"{verdict.found}\t{verdict.seconds:.0f}\t{verdict.by}\t{mutant}\n")


def told(chosen: Sequence[Mutant], verdicts: Verdicts, reasons: Mapping[Mutant, str]) -> float:
    """Say how a sample came out: the share that was killed of what can be, and what was not."""
    found = {x: y for x in chosen if x not in reasons and (y := verdicts.get(str(x)))}
    counts = Counter(verdict.found for verdict in found.values())
    share = 100 * (counts[KILLED] + counts[LATE]) / max(1, len(found))
    numbers = ", ".join(f"{counts[kind]} {kind}" for kind in sorted(counts))
    equal = sum(mutant in reasons for mutant in chosen)
    print(f"{share:.1f} % killed of {len(found)} that were judged: {numbers}; {equal} equivalent")
    for mutant, verdict in found.items():
        if verdict.found in (SURVIVED, OPEN, UNTOLD):
            print(f"{verdict.found}: {mutant.line}: {mutant} {verdict.by}")
    return share


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=400, help="mutants in the sample")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds for tests")
    parser.add_argument("--only", default="rigidpend", help="a file or a folder")
    parser.add_argument("--quick", action="store_true", help="ask quick tests of the folder alone")
    parser.add_argument("--again", action="store_true", help="judge survivors once more")
    parser.add_argument("--least", type=float, default=90.0, help="share to be killed, in %%")
    asked = parser.parse_args()
    every = [mutant for path in files(asked.only) for mutant in mutants(path)]
    chosen = drawn(every, asked.count, asked.seed)
    reasons, verdicts = equivalent(), Verdicts(BUILD / f"{asked.seed}.txt")
    sought = (SURVIVED, UNTOLD, OPEN) if asked.again else () if asked.quick else (OPEN,)
    known = {x for x, y in verdicts.items() if y.found not in sought}
    open_ = [x for x in chosen if x not in reasons and str(x) not in known]
    print(f"seed {asked.seed}: {len(chosen)} of {len(every)} mutants, {len(open_)} to be judged")
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(asked.processes) as pool:
        desk = Desk(Path(folder), asked.processes, asked.limit, quick=asked.quick)

        def judged(mutant: Mutant) -> None:
            verdicts.add(mutant, found := desk.judge(mutant))
            print(f"{found.found:8} {found.seconds:4.0f} s  {mutant}", flush=True)

        list(pool.map(judged, open_))
    return int(told(chosen, verdicts, reasons) < asked.least)


if __name__ == "__main__":
    sys.exit(main())
