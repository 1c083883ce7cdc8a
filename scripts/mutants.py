"""Mutation testing: change the code in one place at a time, and see whether a test fails.

A run draws a sample of all mutants from a stated seed, makes each in a copy of the project and
runs the tests of its module there, in processes of their own. Mutation tools that fork a warm
interpreter (mutmut) or wrap every function (its trampolines) meet compiled integrators that
survive no fork, functions that are handed to worker processes, and functions that run over
symbols; so this one rewrites files and starts anew.

    python -m scripts.mutants --count 150 --seed 1 --processes 2 --keep build/mutants.txt
    python -m scripts.mutants --only rigidpend/experiments/data/compare.py:57

Verdicts that are kept in a file are not sought again: a run that was stopped goes on where it was.
What is declared in `tests/equivalent_mutants.yaml` is not run, and counts apart.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import queue
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from scripts.mutations import ROOT, Mutant, equivalent, mutants, source

COPIED = ("rigidpend", "tests", "configs", "results", "pyproject.toml", "README.md")
PATIENCE = 5
"""A mutant counts as killed after so many times what its tests take without it."""
SLOW = (
    "tests/routes/test_codes.py::test_agrees_engines_on_special_bodies",
    "tests/routes/test_codes.py::test_agrees_deep_start_with_113_bits",
    "tests/routes/test_fig4.py::test_agrees_engines_on_the_right_array",
    "tests/routes/test_fig4.py::test_agrees_every_cell_of_the_left_array_and_all_are_certain[scipy]",
    "tests/routes/test_random_phases.py",
    "tests/mechanics/test_equations.py::test_agrees_eq1_with_aligned_along_an_orbit",
    "tests/runs/test_reference.py::test_every_dataset_altered_by_more_than_its_allowance_is_noticed",
    "tests/runs/test_reference.py::test_each_reference_is_found_again",
)
"""Left for the end: each takes seconds, and hardly a mutant gets as far as them."""
BESIDE = (
    "tests/orbits/integrate/test_neighbours.py",
    "tests/orbits/integrate/test_differences.py",
    "tests/orbits/integrate/test_reference_orbit.py",
    "tests/routes/test_neighbourhood.py",
)
ON_SECTIONS = (
    "tests/orbits/integrate/test_sections.py",
    "tests/orbits/integrate/test_states.py",
    "tests/orbits/return_map",
)
TESTS = {
    "rigidpend/experiments/data/compare.py": (
        "tests/experiments/data/test_compare.py",
        "tests/runs/test_verify.py",
    ),
    "rigidpend/experiments/data/bounds.py": (
        "tests/experiments/data/test_compare.py",
        "tests/runs/test_reference.py",
    ),
    "rigidpend/runs/regression.py": (
        "tests/runs/test_verify.py",
        "tests/runs/test_reference.py",
    ),
    "rigidpend/mechanics/coordinates.py": (
        "tests/mechanics/test_coordinates.py",
        "tests/mechanics/test_coordinates_limits.py",
        "tests/routes/test_start.py",
    ),
    "rigidpend/mechanics/equations.py": (
        "tests/mechanics/test_equations.py",
        "tests/orbits/integrate/test_analytic.py",
    ),
    "rigidpend/routes": ("tests/routes", "tests/experiments/heteroclinic_cycle/test_compute.py"),
    "rigidpend/orbits/integrate": ("tests/orbits/integrate", "tests/routes/test_codes.py"),
    "rigidpend/orbits/integrate/neighbours.py": BESIDE,
    "rigidpend/orbits/integrate/differences.py": BESIDE,
    "rigidpend/orbits/integrate/reference_orbit.py": BESIDE,
    "rigidpend/orbits/integrate/sections.py": ON_SECTIONS,
    "rigidpend/orbits/integrate/states.py": ON_SECTIONS,
}
"""The tests of each module, or of each folder of modules; the quickest to tell come first."""
QUICK = {
    "rigidpend/orbits/integrate/kernel": (
        "tests/orbits/integrate/test_lane_numbers.py",
        "tests/orbits/integrate/test_kernel_functions.py",
        "tests/orbits/integrate/test_sample.py",
        "tests/orbits/integrate/test_kernel.py",
    ),
    "rigidpend/orbits/integrate/batch": (
        "tests/orbits/integrate/test_taylor.py",
        "tests/orbits/integrate/test_sections.py",
        "tests/orbits/integrate/test_sample.py",
    ),
    "rigidpend/orbits/integrate/bounds": ("tests/orbits/integrate/test_touches.py",),
    "rigidpend/orbits/integrate/passages": (
        "tests/orbits/integrate/test_neighbours.py",
        "tests/orbits/integrate/test_reference_orbit.py",
    ),
    "rigidpend/orbits/integrate/roots": (
        "tests/orbits/integrate/test_touches.py",
        "tests/orbits/integrate/test_bigint.py",
    ),
    "rigidpend/routes/rows": ("tests/routes/test_plane.py", "tests/routes/test_bodies.py"),
}
"""Those of a room that know modules of that name best: they run before the others."""
WIDE = (
    "tests/orbits/integrate",
    "tests/orbits/return_map",
    "tests/routes",
    "tests/results",
    "tests/routes/symbolic",
    "tests/surfaces",
    "tests/experiments/stress/trials",
    "tests/mechanics/test_coordinates.py",
    "tests/mechanics/test_coordinates_limits.py",
    "tests/mechanics/test_equations.py",
    "tests/test_imports.py",
    "tests/surfaces/test_variational.py",
)
"""What a mutant has to pass that survives the tests of its module: tests of what is built on it."""
SECONDS = 120
"""What those that know a module best may take at most: they take some 5, or 40 with compiling."""
OPEN, SURVIVED = "open", "survived"
"""Verdicts on a mutant that its own tests do not notice, and that no test does."""
OF_MAPS = ("rigidpend/routes", "rigidpend/results")
"""Modules of which no return map is made: the maps that are kept are those of the code as it is."""


def files() -> list[str]:
    """The files that are mutated."""
    found = [ROOT / name for name in TESTS]
    inner = {file for path in found for file in (path.rglob("*.py") if path.is_dir() else [path])}
    return sorted(str(path.relative_to(ROOT)) for path in inner)


def room_of(path: str) -> tuple[str, tuple[str, ...]]:
    """The narrowest entry of `TESTS` to which a module belongs."""
    return max((x, y) for x, y in TESTS.items() if path == x or path.startswith(f"{x}/"))


def quick_of(path: str, root: Path = ROOT) -> tuple[str, ...]:
    """The tests that know a module best: its own file, where there is one, and others."""
    own = root / "tests" / Path(path).parent.relative_to("rigidpend") / f"test_{Path(path).name}"
    named = [x for name, found in QUICK.items() if path.startswith(name) for x in found]
    return tuple(dict.fromkeys([*([str(own.relative_to(root))] if own.exists() else []), *named]))


class Desk:
    """Copies of the project in which mutants are made, one for each that works at a time.

    A mutant has compiled code and return maps of its own, and begins with those of the code as it
    is: what a mutated module compiles must not be found by the next one, nor by the user.
    """

    def __init__(self, folder: Path, copies: int, limit: float) -> None:
        self.compiled = folder / "compiled"
        self.free: queue.Queue[Path] = queue.Queue()
        self.limit = limit
        self.limits: dict[tuple[str, ...], float] = {}
        for k in range(copies):
            self.free.put(copied(folder / str(k)))

    def measure(self, tests: tuple[str, ...]) -> None:
        """How long a mutant may take for tests; without one they must pass."""
        folder, begun = self.free.get(), time.monotonic()
        try:
            passed = passes(folder, tests, self.compiled, wide=tests == WIDE)
        finally:
            self.free.put(folder)
        if not passed:
            raise SystemExit(f"without a mutant these fail: {' '.join(tests)}")
        taken = time.monotonic() - begun
        print(f"{taken:.0f} s without a mutant: {' '.join(tests)}", flush=True)
        self.limits[tests] = self.limit or 30 + PATIENCE * taken

    def judge(self, mutant: Mutant, *, wide: bool = False) -> str:
        """The verdict of a mutant's own tests, or of the wide ones, which is said."""
        folder, begun = self.free.get(), time.monotonic()
        target = folder / mutant.path
        before = target.read_text()
        target.write_text(source(mutant))
        try:
            found = self._verdict(mutant, folder, wide=wide)
        finally:
            target.write_text(before)
            self.free.put(folder)
        print(f"{found:8} {time.monotonic() - begun:5.0f} s  {mutant}", flush=True)
        return found

    def _verdict(self, mutant: Mutant, folder: Path, *, wide: bool) -> str:
        cache = folder / "cache"
        shutil.rmtree(cache, ignore_errors=True)
        shutil.copytree(self.compiled, cache)
        if not mutant.path.startswith(OF_MAPS):
            shutil.rmtree(cache / "rigidpend" / "maps", ignore_errors=True)
        _, tests = room_of(mutant.path)
        whole = WIDE if wide else tests
        # In calls of their own: within one, pytest would take a folder's files by their names.
        calls = {whole: self.limits[whole]}
        quick = quick_of(mutant.path, folder)
        if quick and not wide:
            calls = {quick: min(SECONDS, self.limits[whole]), **calls}
        try:
            if all(passes(folder, x, cache, calls[x], wide=wide) for x in calls):
                return SURVIVED if wide else OPEN
        except subprocess.TimeoutExpired:
            return "timeout"
        return "killed"


def passes(
    folder: Path,
    tests: Sequence[str],
    cache: Path,
    limit: float | None = None,
    *,
    wide: bool = False,
) -> bool:
    """Whether tests pass in a copy of the project, which they may be given so many seconds for."""
    left_out = [] if wide else [f"--deselect={name}" for name in SLOW]
    plugins = ["-p", "no:cacheprovider", "-p", "tests.unshrunk"]
    call = [sys.executable, "-m", "pytest", "-x", "-q", *plugins, *left_out]
    where = {"PYTHONPATH": str(folder), "XDG_CACHE_HOME": str(cache)}
    done = subprocess.run(
        [*call, *tests],
        cwd=folder,
        env={**os.environ, **where, "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        timeout=limit,
        check=False,
    )
    if done.returncode >= 4:
        raise SystemExit(f"pytest could not run {' '.join(tests)}:\n{done.stdout.decode()}")
    return done.returncode == 0


def copied(folder: Path) -> Path:
    """A copy of the project, to be mutated."""
    folder.mkdir()
    for name in COPIED:
        copy_one = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy_one(ROOT / name, folder / name)
    return folder


class Verdicts(dict[str, str]):
    """The verdicts on mutants, by what they are called; kept in a file, if one is given."""

    def __init__(self, kept: Path | None) -> None:
        super().__init__()
        self.kept = kept
        if not kept:
            return
        if not kept.exists():
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_text(f"{_digest()}\n")
        first, *lines = kept.read_text().splitlines()
        if first != _digest():
            raise SystemExit(f"{kept}: these verdicts are on other code; remove it to begin anew")
        self.update((mutant, found) for found, _, mutant in (x.partition("\t") for x in lines))

    def add(self, mutant: Mutant, found: str) -> None:
        self[str(mutant)] = found
        if self.kept:
            with self.kept.open("a") as file:
                file.write(f"{found}\t{mutant}\n")


def _digest() -> str:
    texts = [(ROOT / path).read_bytes() for path in files()]
    return hashlib.sha256(b"\0".join(texts)).hexdigest()


def run(chosen: list[Mutant], processes: int, limit: float, verdicts: Verdicts) -> None:
    """Judge mutants by their own tests, then those that survive by the wide ones."""
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(processes) as pool:
        desk = Desk(Path(folder), processes, limit)

        def judged(mutant: Mutant) -> None:
            verdicts.add(mutant, desk.judge(mutant, wide=verdicts.get(str(mutant)) == OPEN))

        fresh = [mutant for mutant in chosen if verdicts.get(str(mutant)) != OPEN]
        list(pool.map(desk.measure, sorted({room_of(mutant.path)[1] for mutant in fresh})))
        list(pool.map(judged, fresh))
        open_ = [mutant for mutant in chosen if verdicts[str(mutant)] == OPEN]
        if open_:
            desk.measure(WIDE)
        list(pool.map(judged, open_))


def told(chosen: list[Mutant], verdicts: Verdicts, reasons: dict[Mutant, str]) -> float:
    """Say how a sample came out: the share that was killed of those that are not equivalent."""
    counts = Counter(verdicts[str(mutant)] for mutant in chosen if mutant not in reasons)
    alike = sum(mutant in reasons for mutant in chosen)
    killed, able = counts["killed"] + counts["timeout"], counts.total()
    print(f"{len(chosen)} mutants: {alike} declared equivalent, {dict(counts)}")
    share = 100 * killed / max(1, able)
    print(f"{share:.1f} % killed of the {able} that are not equivalent")
    print(f"{100 * killed / max(1, len(chosen)):.1f} % killed of all {len(chosen)} that were drawn")
    for mutant in chosen:
        if mutant in reasons:
            print(f"equivalent: {mutant}: {reasons[mutant]}")
        elif verdicts[str(mutant)] == SURVIVED:
            print(f"survived: {mutant}")
    return share


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=150, help="mutants in the sample")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--limit", type=float, default=0, help="seconds; measured if not given")
    parser.add_argument("--only", default="", help="PATH or PATH:LINE, all mutants there")
    parser.add_argument("--keep", type=Path, help="a file of verdicts, to go on from")
    parser.add_argument("--again", action="store_true", help="judge kept survivors once more")
    parser.add_argument("--least", type=float, default=90.0, help="share to be killed, in %%")
    asked = parser.parse_args()
    every = [mutant for path in files() for mutant in mutants(path)]
    if asked.only:
        path, _, line = asked.only.partition(":")
        chosen = [x for x in every if x.path == path and (not line or x.line == int(line))]
    else:
        chosen = random.Random(asked.seed).sample(every, min(asked.count, len(every)))
    reasons, verdicts = equivalent(), Verdicts(asked.keep)
    sought = (None, OPEN, asked.again and SURVIVED)
    able = [x for x in chosen if x not in reasons and verdicts.get(str(x)) in sought]
    print(f"seed {asked.seed}: {len(chosen)} of {len(every)} mutants, {len(able)} to be judged")
    if able:
        run(able, asked.processes, asked.limit, verdicts)
    return int(told(chosen, verdicts, reasons) < asked.least)


if __name__ == "__main__":
    sys.exit(main())
