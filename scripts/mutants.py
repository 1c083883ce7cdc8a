"""Mutation testing: change the code in one place at a time, and see whether a test fails.

A run draws a sample of all mutants from a stated seed, makes each in a copy of the project and
runs the tests of its module there, in processes of their own. Mutation tools that fork a warm
interpreter (mutmut) or wrap every function (its trampolines) meet compiled integrators that
survive no fork, functions that are handed to worker processes, and functions that run over
heyoka's symbols; so this one rewrites files and starts anew.

    python scripts/mutants.py --count 150 --seed 1 --processes 2
    python scripts/mutants.py --only rigidpend/results/compare.py:57
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import queue
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("rigidpend", "tests", "configs", "results", "pyproject.toml", "README.md")
PATIENCE = 5
"""A mutant counts as killed after so many times what its tests take without it."""
SLOW = (
    "tests/routes/test_codes.py::test_agrees_engines_on_special_bodies",
    "tests/routes/test_codes.py::test_agrees_deep_start_with_113_bits",
    "tests/routes/test_fig4.py::test_agrees_engines_on_the_right_array",
    "tests/routes/test_fig4.py::test_agrees_every_cell_of_the_left_array_and_all_are_certain[scipy]",
    "tests/routes/test_random_phases.py",
    "tests/test_equations.py::test_agrees_eq1_with_aligned_along_an_orbit",
    "tests/results/test_reference.py::test_every_dataset_altered_by_more_than_its_allowance_is_noticed",
    "tests/results/test_reference.py::test_every_build_agrees_with_the_same_references",
)
"""Left out: each takes seconds, and a mutant that lives has to sit through all of them."""
BESIDE = (
    "tests/integrate/test_neighbours.py",
    "tests/integrate/test_differences.py",
    "tests/integrate/test_reference_orbit.py",
    "tests/routes/test_neighbourhood.py",
)
ON_SECTIONS = (
    "tests/integrate/test_sections.py",
    "tests/integrate/test_arcs.py",
    "tests/return_map",
)
TESTS = {
    "rigidpend/results/compare.py": (
        "tests/results/test_compare.py",
        "tests/results/test_verify.py",
    ),
    "rigidpend/results/regression.py": (
        "tests/results/test_verify.py",
        "tests/results/test_reference.py",
    ),
    "rigidpend/coordinates.py": (
        "tests/test_coordinates.py",
        "tests/test_coordinates_limits.py",
        "tests/routes/test_start.py",
    ),
    "rigidpend/equations.py": ("tests/test_equations.py", "tests/integrate/test_analytic.py"),
    "rigidpend/routes": ("tests/routes", "tests/experiments/heteroclinic_cycle/test_compute.py"),
    "rigidpend/integrate": ("tests/integrate", "tests/routes/test_codes.py"),
    "rigidpend/integrate/neighbours.py": BESIDE,
    "rigidpend/integrate/differences.py": BESIDE,
    "rigidpend/integrate/reference_orbit.py": BESIDE,
    "rigidpend/integrate/sections.py": ON_SECTIONS,
    "rigidpend/integrate/batch_sections.py": ON_SECTIONS,
    "rigidpend/integrate/arcs.py": ON_SECTIONS,
}
"""The tests of each module, or of each folder of modules; the quickest to tell come first."""

COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
}


class Mutant(NamedTuple):
    """One change of one place."""

    path: str
    line: int
    number: int
    """Of the place in the file, in the order of :func:`places`."""
    said: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}#{self.number}: {self.said}"


def changed(node: ast.AST) -> tuple[ast.AST, str] | None:
    """A mutated copy of a node with what changed in it, if it is of a kind that is mutated."""
    other = copy.deepcopy(node)
    match other:
        case ast.Compare(ops=[op, *_]) if type(op) in COMPARISONS:
            other.ops[0] = COMPARISONS[type(op)]()
        case ast.BinOp(op=op) if type(op) in OPERATORS:
            other.op = OPERATORS[type(op)]()
        case ast.AugAssign(op=op) if type(op) in OPERATORS:
            other.op = OPERATORS[type(op)]()
        case ast.BoolOp():
            other.op = ast.Or() if isinstance(other.op, ast.And) else ast.And()
        case ast.UnaryOp(op=ast.USub() | ast.Not()):
            other = other.operand
        case ast.Constant(value=bool() as value):
            other.value = not value
        case ast.Constant(value=int() | float() as value):
            other.value = value + 1 if isinstance(value, int) else 2 * value + (value == 0)
        case ast.IfExp() | ast.If() | ast.While():
            other.test = ast.UnaryOp(ast.Not(), other.test)
        case ast.Expr(value=ast.Call()):
            other.value = ast.Constant(None)
        case ast.Return(value=ast.expr()):
            other.value = ast.Constant(None)
        case _:
            return None
    return other, f"{_shown(node)}  ->  {_shown(other)}"


def _shown(node: ast.AST) -> str:
    first, *rest = ast.unparse(ast.fix_missing_locations(copy.deepcopy(node))).splitlines()
    return first[:70] + (" ..." if rest or len(first) > 70 else "")


def places(tree: ast.Module) -> Iterator[tuple[ast.AST, str, int | None, ast.AST]]:
    """Every place that can be mutated: its holder, field, index, and the node there."""
    skipped = set()
    for holder in ast.walk(tree):
        if isinstance(holder, ast.AnnAssign | ast.arg) and holder.annotation:
            skipped |= set(ast.walk(holder.annotation))
        if isinstance(holder, ast.FunctionDef) and holder.returns:
            skipped |= set(ast.walk(holder.returns))
    for holder in ast.walk(tree):
        for field, value in ast.iter_fields(holder):
            members = list(enumerate(value)) if isinstance(value, list) else [(None, value)]
            for index, node in members:
                if isinstance(node, ast.AST) and node not in skipped and changed(node):
                    yield holder, field, index, node


def mutants(path: str) -> list[Mutant]:
    """All mutants of a file."""
    tree = ast.parse((ROOT / path).read_text())
    made = []
    for number, (*_, node) in enumerate(places(tree)):
        change = changed(node)
        assert change
        made.append(Mutant(path, getattr(node, "lineno", 0), number, change[1]))
    return made


def source(mutant: Mutant) -> str:
    """The file's text with the mutant in it."""
    tree = ast.parse((ROOT / mutant.path).read_text())
    holder, field, index, node = list(places(tree))[mutant.number]
    change = changed(node)
    assert change
    if index is None:
        setattr(holder, field, change[0])
    else:
        getattr(holder, field)[index] = change[0]
    return ast.unparse(ast.fix_missing_locations(tree))


def files() -> list[str]:
    """The files that are mutated."""
    found = [ROOT / name for name in TESTS]
    inner = {file for path in found for file in (path.rglob("*.py") if path.is_dir() else [path])}
    return sorted(str(path.relative_to(ROOT)) for path in inner)


def room_of(path: str) -> tuple[str, tuple[str, ...]]:
    """The narrowest entry of `TESTS` to which a module belongs."""
    return max((x, y) for x, y in TESTS.items() if path == x or path.startswith(f"{x}/"))


def tests_of(path: str) -> list[str]:
    """The tests of a module: its own file first, where there is one, then those of its room."""
    room, tests = room_of(path)
    own = ROOT / "tests" / Path(room).name / f"test_{Path(path).stem}.py"
    return [*([str(own.relative_to(ROOT))] if own.exists() else []), *tests]


def verdict(mutant: Mutant, folder: Path, limit: float) -> str:
    """Make the mutant in a copy of the project, run its tests there, undo it."""
    target = folder / mutant.path
    before = target.read_text()
    target.write_text(source(mutant))
    try:
        return "survived" if passes(folder, tests_of(mutant.path), limit) else "killed"
    except subprocess.TimeoutExpired:
        return "timeout"
    finally:
        target.write_text(before)


def passes(folder: Path, tests: Sequence[str], limit: float | None = None) -> bool:
    """Whether tests pass in a copy of the project, which they may be given so many seconds for."""
    left_out = [f"--deselect={name}" for name in SLOW]
    call = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *left_out]
    done = subprocess.run(
        [*call, *tests],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        timeout=limit,
        check=False,
    )
    if done.returncode >= 4:
        raise SystemExit(f"pytest could not run {' '.join(tests)}:\n{done.stdout.decode()}")
    return done.returncode == 0


def run(chosen: list[Mutant], processes: int, limit: float) -> list[tuple[Mutant, str]]:
    """The verdicts of mutants, each said as it comes."""
    with tempfile.TemporaryDirectory() as desk:
        folders: queue.Queue[Path] = queue.Queue()
        for k in range(processes):
            folders.put(copied(Path(desk) / str(k)))
        limits = {
            room: limit or limit_of(room, Path(desk) / "0")
            for room in {room_of(mutant.path) for mutant in chosen}
        }

        def judged(mutant: Mutant) -> tuple[Mutant, str]:
            folder, begun = folders.get(), time.monotonic()
            try:
                found = verdict(mutant, folder, limits[room_of(mutant.path)])
            finally:
                folders.put(folder)
            print(f"{found:8} {time.monotonic() - begun:5.0f} s  {mutant}", flush=True)
            return mutant, found

        with ThreadPoolExecutor(processes) as pool:
            return list(pool.map(judged, chosen))


def copied(folder: Path) -> Path:
    """A copy of the project, to be mutated."""
    folder.mkdir()
    for name in COPIED:
        copy_one = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy_one(ROOT / name, folder / name)
    return folder


def limit_of(room: tuple[str, tuple[str, ...]], folder: Path) -> float:
    """Seconds for a mutant in a room; without one its tests must pass."""
    begun = time.monotonic()
    if not passes(folder, room[1]):
        raise SystemExit(f"without a mutant these fail: {' '.join(room[1])}")
    taken = time.monotonic() - begun
    print(f"{taken:.0f} s without a mutant: {room[0]}", flush=True)
    return 30 + PATIENCE * taken


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=150, help="mutants in the sample")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--limit", type=float, default=0, help="seconds; measured if not given")
    parser.add_argument("--only", default="", help="PATH or PATH:LINE, all mutants there")
    parser.add_argument("--least", type=float, default=90.0, help="share to be killed, in %%")
    asked = parser.parse_args()
    every = [mutant for path in files() for mutant in mutants(path)]
    if asked.only:
        path, _, line = asked.only.partition(":")
        chosen = [x for x in every if x.path == path and (not line or x.line == int(line))]
    else:
        chosen = random.Random(asked.seed).sample(every, min(asked.count, len(every)))
    found = run(chosen, asked.processes, asked.limit)
    counts = Counter(verdict for _, verdict in found)
    share = 100 * (1 - counts["survived"] / max(1, len(found)))
    print(f"{len(found)} of {len(every)} mutants, seed {asked.seed}: {dict(counts)}")
    print(f"{share:.1f} % killed")
    print("\n".join(f"survived: {mutant}" for mutant, one in found if one == "survived"))
    return int(share < asked.least)


if __name__ == "__main__":
    sys.exit(main())
