"""Mutation testing: change the code in one place at a time, and see whether a test fails.

A run draws a sample of all places of the package from a stated seed, makes each change in a copy of
the project and runs there, in processes of their own, the test file that mirrors the module, then
the tests that reach the line, and at last the whole of the mirrored folder. Which tests reach a
line is told by a map, which one run of the tests makes under coverage.

    python -m scripts.mutants --map                          # once: all tests, some ten minutes
    python -m scripts.mutants --count 400 --seed 1 --processes 2
    python -m scripts.mutants --only rigidpend/routes/certified

Verdicts are kept, and not sought again: a run that was stopped goes on where it was. What is
declared in `tests/equivalent_mutants.yaml` is not run, and counts apart. `tests/MUTANTS.md` says
why this is no tool of others.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import queue
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from coverage import CoverageData

from scripts.mutations import ROOT, Mutant, drawn, equivalent, mutants, source

BUILD = ROOT / "build" / "mutants"
COPIED = ("rigidpend", "tests", "scripts", "docs", "configs", "results")
"""What a copy of the project has of its own; the rest it shares."""
OF_TEXT = tuple(
    f"tests/test_{name}.py"
    for name in (
        "english",
        "floors",
        "generated_pages",
        "imports",
        "labels",
        "mutants",
        "readme",
    )
)
"""Tests of the texts: they notice that a file is written anew, whatever it says."""
OF_PEERS = ("cyrk_compiled", "diffrax_vmapped")
"""Methods of libraries that the tests do without."""
MOST = 100
"""Tests at most that the map adds to the mirrored file, the most particular ones first."""
ALIKE = 3
"""Of the cases of one test as many at most."""
LIMIT = 300.0
"""Seconds that tests may take before they are held against the code as it is."""
KILLED, LATE, SURVIVED = "killed", "timeout", "survived"
OPEN, UNTOLD = "open", "untold"
"""What the nearest tests do not notice; what no verdict was found on, for tests fail without it."""
Map = Mapping[str, Mapping[str, Sequence[str]]]
"""Tests by path and by the text of the line, "" for what any line of a function needs."""


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


class Desk:
    """Copies of the project in which mutants are made, one for each that works at a time.

    A mutant has compiled code and return maps of its own, and begins with those of the user: what
    a mutated module compiles must not be found by the next one.
    """

    def __init__(
        self, folder: Path, copies: int, of_tests: Map, limit: float, *, quick: bool
    ) -> None:
        self.free: queue.Queue[Path] = queue.Queue()
        self.of_tests, self.limit, self.quick = of_tests, limit, quick
        self.sound: dict[tuple[str, str], bool] = {}
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
        folder, begun = self.free.get(), time.monotonic()
        target = folder / mutant.path
        before = target.read_text()
        try:
            target.write_text(source(before, mutant))
            found, by = self._verdict(mutant, folder, source(before))
        finally:
            target.write_text(before)
            self.free.put(folder)
        return Verdict(found, by, time.monotonic() - begun)

    def _verdict(self, mutant: Mutant, folder: Path, plain: str) -> tuple[str, str]:
        near = nearest(mutant, self.of_tests)
        rest = [] if self.quick and near else around(mutant, near)
        for tests in filter(None, (near, rest)):
            failed = failing(folder, tests, self.kept, self.limit)
            if failed is None:
                return (LATE if self._in_time(mutant, folder, plain, tests) else UNTOLD), ""
            if failed and self._is_sound(mutant, folder, plain, failed):
                return KILLED, failed
            if failed:
                return UNTOLD, failed
        return (OPEN if self.quick else SURVIVED), ""

    def _in_time(self, mutant: Mutant, folder: Path, plain: str, tests: Sequence[str]) -> bool:
        """Whether the tests pass in half of the time, without the mutant."""
        (folder / mutant.path).write_text(plain)
        return failing(folder, tests, self.kept, self.limit / 2) == ""

    def _is_sound(self, mutant: Mutant, folder: Path, plain: str, test: str) -> bool:
        """Whether a test passes where the file is written anew and means the same."""
        at = (mutant.path, test)
        if at not in self.sound:
            (folder / mutant.path).write_text(plain)
            self.sound[at] = failing(folder, [test], self.kept, self.limit) == ""
        return self.sound[at]


def mirrored(path: str) -> Path:
    """The folder of tests of a module."""
    return Path("tests") / Path(path).parent.relative_to("rigidpend")


def nearest(mutant: Mutant, of_tests: Map) -> list[str]:
    """The mirrored test file, then the tests that reach the line, the most particular first."""
    folder, stem = mirrored(mutant.path), Path(mutant.path).stem
    own = [str(file) for file in [folder / f"test_{stem}.py"] if (ROOT / file).exists()]
    of_file = of_tests.get(mutant.path, {})
    reached = of_file.get(mutant.statement, of_file.get("", ()))
    others = [test for test in reached if test.partition("::")[0] not in own]
    return [*own, *sorted(others, key=lambda test: not test.startswith(f"{folder}/"))][:MOST]


def around(mutant: Mutant, before: Sequence[str]) -> list[str]:
    """All test files of the mirrored folder that were not run, or of the one above."""
    folder = ROOT / mirrored(mutant.path)
    while not any(folder.glob("test_*.py")):
        folder = folder.parent
    found = (str(x.relative_to(ROOT)) for x in sorted(folder.rglob("test_*.py")))
    return [x for x in found if x not in before and x not in OF_TEXT]


def failing(folder: Path, tests: Sequence[str], kept: Path, limit: float) -> str | None:
    """The first test that fails in a copy of the project, "" if none does, None without an end."""
    cache = folder / "cache"
    shutil.rmtree(cache, ignore_errors=True)
    shutil.copytree(kept, cache)
    plugins = ["no:cacheprovider", "no:xdist", "no:cov", "tests.unshrunk"]
    call = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", "--tb=no", "--no-header"]
    where = {"PYTHONPATH": str(folder), "XDG_CACHE_HOME": str(cache)}
    process = subprocess.Popen(
        [*call, *(x for name in plugins for x in ("-p", name)), *tests],
        cwd=folder,
        env={**os.environ, **where, "PYTHONDONTWRITEBYTECODE": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        said, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        # Its own processes with it: they have a session of their own.
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return None
    if process.returncode in (0, 5):
        return ""
    # The map is older than the tests; pytest tells the function, without its case.
    gone = set(re.findall(r"^ERROR: .*not found: (?:.*/)?(tests/.*)$", said, re.MULTILINE))
    left = [test for test in tests if test.partition("[")[0] not in gone]
    if len(left) < len(tests):
        return failing(folder, left, kept, limit) if left else ""
    named = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", said, re.MULTILINE)
    return named[1] if named else tests[0]


def copied(folder: Path) -> Path:
    """A copy of the project, to be mutated."""
    folder.mkdir(parents=True)
    for path in ROOT.iterdir():
        if path.name in COPIED:
            shutil.copytree(path, folder / path.name, ignore=shutil.ignore_patterns("__pycache__"))
        elif path.name not in (".git", "build"):
            (folder / path.name).symlink_to(path)
    return folder


def make_map(asked: Sequence[str]) -> None:
    """Run tests under coverage and keep which of them reach which line, by the line's text."""
    data = BUILD / "coverage"
    BUILD.mkdir(parents=True, exist_ok=True)
    left_out = [f"--ignore={file}" for file in OF_TEXT]
    counted = ["--cov", "--cov-context=test", "--cov-report=", "--cov-fail-under=0"]
    call = [sys.executable, "-m", "pytest", "-q", *counted, *left_out, *asked]
    subprocess.run(call, cwd=ROOT, env={**os.environ, "COVERAGE_FILE": str(data)}, check=True)
    found = CoverageData(str(data))
    found.read()
    write_map(found)


def write_map(found: CoverageData) -> None:
    """Keep the map of a run's coverage, the tests of a line in order of what else they reach."""
    reached: dict[str, dict[str, set[str]]] = {}
    breadth: Counter[str] = Counter()
    for file in found.measured_files():
        path = Path(file)
        lines = path.read_text().splitlines()
        name = str(Path("rigidpend", *path.parts[path.parts.index("rigidpend") + 1 :]))
        of_file = reached.setdefault(name, defaultdict(set))
        for line, contexts in found.contexts_by_lineno(file).items():
            tests = {x.partition("|")[0] for x in contexts if x.endswith("|run")}
            tests = {x for x in tests if not x.startswith(OF_TEXT)}
            breadth.update(tests)
            of_file[lines[line - 1].strip()] |= tests
    number = {test: k for k, test in enumerate(breadth)}
    kept: dict[str, dict[str, list[int]]] = {}
    for name, of_file in reached.items():
        # What stands outside a function runs once, for the first who imports it.
        whole, beside = set().union(*of_file.values()), f"{mirrored(name)}/"
        first = sorted(whole, key=lambda x: (not x.startswith(beside), breadth[x], x))
        kept[name] = {
            text: [number[x] for x in _few(x for x in first if x in (tests or whole))]
            for text, tests in [*of_file.items(), ("", whole)]
        }
    (BUILD / "map.json").write_text(json.dumps({"tests": list(number), "reached": kept}))


def _few(tests: Iterable[str]) -> list[str]:
    """The first of them, no more than some of one function."""
    seen: Counter[str] = Counter()
    found = []
    for test in tests:
        seen[name := test.partition("[")[0]] += 1
        if seen[name] <= ALIKE:
            found.append(test)
    return found[:MOST]


def read_map() -> Map:
    """The map that was kept."""
    if not (BUILD / "map.json").exists():
        raise SystemExit("which tests reach which line? `python -m scripts.mutants --map` tells")
    kept = json.loads((BUILD / "map.json").read_text())
    tests = kept["tests"]
    return {
        name: {text: [tests[k] for k in ranks] for text, ranks in of_file.items()}
        for name, of_file in kept["reached"].items()
    }


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


def room(path: str) -> str:
    """The room to which a module belongs, as the table of a sample counts it."""
    _, floor, *rest = path.split("/")
    return f"{floor}/{rest[0]}" if len(rest) > 1 and floor in ("orbits", "routes") else floor


def told(chosen: Sequence[Mutant], verdicts: Verdicts, reasons: Mapping[Mutant, str]) -> float:
    """Say how a sample came out, room by room: the share that was killed of what can be."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for mutant in chosen:
        verdict = verdicts.get(str(mutant))
        found = "equivalent" if mutant in reasons else verdict.found if verdict else "unjudged"
        for name in (room(mutant.path), "all"):
            counts[name][found] += 1
    kinds = ("equivalent", KILLED, LATE, SURVIVED, OPEN, UNTOLD, "unjudged")
    print(f"| room | drawn | {' | '.join(kinds)} |")
    print("|---" * (2 + len(kinds)) + "|")
    for name in [*sorted(counts.keys() - {"all"}), "all"]:
        numbers = [counts[name].total(), *(counts[name][kind] for kind in kinds)]
        print(f"| {name} | {' | '.join(map(str, numbers))} |")
    whole = counts["all"]
    able = whole.total() - whole["equivalent"] - whole["unjudged"]
    share = 100 * (whole[KILLED] + whole[LATE]) / max(1, able)
    print(f"{share:.1f} % killed of {able} that were judged")
    for mutant in chosen:
        if mutant not in reasons and (verdict := verdicts.get(str(mutant))):
            if verdict.found in (SURVIVED, OPEN, UNTOLD):
                print(f"{verdict.found}: {mutant.line}: {mutant} {verdict.by}")
    return share


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--map", nargs="*", help="make the map of tests, with options of pytest")
    parser.add_argument("--count", type=int, default=400, help="mutants in the sample")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds for tests")
    parser.add_argument("--only", default="rigidpend", help="a file or a folder")
    parser.add_argument("--minutes", type=float, default=0, help="judge no more after so many")
    parser.add_argument("--quick", action="store_true", help="leave out the rest of the folder")
    parser.add_argument("--again", action="store_true", help="judge survivors once more")
    parser.add_argument("--least", type=float, default=90.0, help="share to be killed, in %%")
    asked = parser.parse_args()
    if asked.map is not None:
        make_map(asked.map)
        return 0
    of_tests = read_map()
    every = [mutant for path in files(asked.only) for mutant in mutants(path)]
    chosen = drawn(every, asked.count, asked.seed)
    reasons, verdicts = equivalent(), Verdicts(BUILD / f"{asked.seed}.txt")
    sought = (SURVIVED, UNTOLD, OPEN) if asked.again else () if asked.quick else (OPEN,)
    known = {x for x, y in verdicts.items() if y.found not in sought}
    open_ = [x for x in chosen if x not in reasons and str(x) not in known]
    print(f"seed {asked.seed}: {len(chosen)} of {len(every)} mutants, {len(open_)} to be judged")
    end = time.monotonic() + 60 * asked.minutes if asked.minutes else float("inf")
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(asked.processes) as pool:
        desk = Desk(Path(folder), asked.processes, of_tests, asked.limit, quick=asked.quick)

        def judged(mutant: Mutant) -> None:
            if time.monotonic() < end:
                verdicts.add(mutant, found := desk.judge(mutant))
                print(f"{found.found:8} {found.seconds:4.0f} s  {mutant}", flush=True)

        list(pool.map(judged, open_))
    return int(told(chosen, verdicts, reasons) < asked.least)


if __name__ == "__main__":
    sys.exit(main())
