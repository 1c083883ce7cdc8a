"""Which tests reach which line of the package, and how long each takes.

One run of tests under coverage tells both. Lines are known by their text, so that the map stays
good while other lines change.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from coverage import CoverageData

from scripts.mutations import ROOT

BUILD = ROOT / "build" / "mutants"
MAP = BUILD / "map.json"
OF_TEXT = tuple(f"tests/test_{name}.py" for name in ("imports", "labels", "mutants", "readme"))
"""Tests of the texts: they notice that a file is written anew, whatever it says."""
MOST = 100
"""Tests at most that are kept for a line, the most particular ones first."""
ALIKE = 3
"""Of the cases of one test as many at most."""


class Reach(NamedTuple):
    """The map."""

    seconds: Mapping[str, float]
    """Of each test, with what it is the first to set up."""
    tests: Mapping[str, Mapping[str, Sequence[str]]]
    """Tests by path and by the text of the line, "" for what any line of a function needs."""

    def of(self, path: str, line: str) -> Sequence[str]:
        """The tests that reach a line, or its file where no test is known to reach the line."""
        of_file = self.tests.get(path, {})
        return of_file.get(line, of_file.get("", ()))


def make(asked: Sequence[str]) -> None:
    """Run tests under coverage, with options of pytest, and keep the map."""
    data, times = BUILD / "coverage", BUILD / "times.xml"
    BUILD.mkdir(parents=True, exist_ok=True)
    left_out = [f"--ignore={file}" for file in OF_TEXT]
    counted = ["--cov", "--cov-context=test", "--cov-report=", "--cov-fail-under=0"]
    call = [sys.executable, "-m", "pytest", "-q", f"--junitxml={times}", *counted, *left_out]
    env = {**os.environ, "COVERAGE_FILE": str(data)}
    subprocess.run([*call, *asked], cwd=ROOT, env=env, check=True)
    found = CoverageData(str(data))
    found.read()
    write(found, times)


def write(found: CoverageData, times: Path) -> None:
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
    known = _seconds(times)
    seconds = [known.get(test, 1.0) for test in number]
    MAP.write_text(json.dumps({"tests": list(number), "seconds": seconds, "reached": kept}))


def _seconds(times: Path) -> dict[str, float]:
    """What pytest's report says of the tests, by their names."""
    return {
        f"{case.attrib['classname'].replace('.', '/')}.py::{case.attrib['name']}": float(
            case.attrib["time"]
        )
        for case in ElementTree.parse(times).iter("testcase")
    }


def read() -> Reach:
    """The map that was kept."""
    if not MAP.exists():
        raise SystemExit("which tests reach which line? `python -m scripts.mutants --map` tells")
    kept = json.loads(MAP.read_text())
    tests = kept["tests"]
    return Reach(
        dict(zip(tests, kept["seconds"], strict=True)),
        {
            name: {text: [tests[k] for k in ranks] for text, ranks in of_file.items()}
            for name, of_file in kept["reached"].items()
        },
    )


def mirrored(path: str) -> Path:
    """The folder of tests of a module."""
    return Path("tests") / Path(path).parent.relative_to("rigidpend")


def _few(tests: Iterable[str]) -> list[str]:
    """The first of them, no more than some of one function."""
    seen: Counter[str] = Counter()
    found = []
    for test in tests:
        seen[name := test.partition("[")[0]] += 1
        if seen[name] <= ALIKE:
            found.append(test)
    return found[:MOST]
