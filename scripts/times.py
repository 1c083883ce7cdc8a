"""Times that the pages tell, measured here and written into them.

    .venv/bin/python -m scripts.times [BLOCK ...]

All are times of processors, which hardly depend on what else goes on, of the commands that stand
in the tables. All of them together take a quarter of an hour.
"""

import argparse
import json
import pickle
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

from rigidpend import Body, find_orbit, route_codes
from rigidpend.experiments.contract import Piece
from rigidpend.experiments.route_map import PLANE, compute
from rigidpend.machine.progress import tell_nobody
from rigidpend.machine.wording import Table, markdown, seconds
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.results import store
from rigidpend.runs import cluster, loading
from rigidpend.runs.parts import Parts
from rigidpend.runs.provenance import provenance
from scripts.readme_tables import ROOT, write_table

BODY = Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001")
START: dict[str, Any] = {"h0": "1.3342", "J1_0": "1e-8"}
"""Those of Fig. 4."""
BITS = (53, 106, 160, 212, 320, 424)
LENGTHS = (40, 76, 100, 150)
EACH, SPARE = 1.28, 5
"""Digits of a phase for each symbol, and besides: no word of these needs more."""
JOBS = 2
SEED = 1
PARTS = 400
"""Parts that do nothing, which a cluster is given."""
CONFIGS = ("fig5", "full_shift", "fig4")
LONG = ("fig4",)
"""Those that the second checker is not asked for: it would take most of the time."""


MAP = ROOT / "configs" / "route_map.yaml"
SHARED = ("problem.zooms={}", "problem.n_symbols=15", "numerics.precisions=[53, 106, 160]")
BY_MAPS = (
    "problem.theta2_0.count=512",
    "problem.rows={axis: log10_J1_0, ends: [-9, -7], count: 256}",
)
OWN_BODIES = (
    "problem.theta2_0=1",
    "problem.columns={axis: beta0, ends: [1, 2], count: 16}",
    "problem.rows={axis: mu, ends: [1/1000, 2/1000], count: 16}",
)


def own() -> float:
    """Processor time of this process and of those that it has waited for, in seconds."""
    each = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(used.ru_utime + used.ru_stime for used in each)


def taken(work: Callable[[], object], least: float = 0.0) -> float:
    """Processor time of some work, repeated until that much has gone by; the least of all."""
    found: list[float] = []
    while not found or sum(found) < least:
        begun = own()
        work()
        found.append(own() - begun)
    return min(found)


def orbit_table() -> Table:
    """Times of one orbit's five symbols, twice computed, by the bits of the computation."""
    rows = []
    for bits in BITS:
        asked = {**START, "n_symbols": 5, "precisions": (bits,)}
        work = partial(route_codes, BODY, ["0.3"], **asked)
        work()  # what is compiled is compiled now
        rows.append((str(bits), seconds(taken(work, 0.5))))
    return Table("", ("bits", "five symbols of Fig. 4, computed twice"), rows)


def found_table() -> Table:
    """Times to find the orbit of a random word, its symbols established from its phase alone."""
    chance, rows = random.Random(SEED), []
    for length in LENGTHS:
        word, begun = "".join(chance.choices("01", k=length)), own()
        digits = round(EACH * length) + SPARE
        found = find_orbit(BODY, word, **START, digits=digits, jobs=JOBS)
        known = "all" if found.confirmed == length else str(found.confirmed)
        rows.append((str(length), str(digits), str(found.bits), seconds(own() - begun), known))
    return Table("", ("symbols", "digits", "bits", "to find and establish", "established"), rows)


def proof_table() -> Table:
    """Times to prove, to check and to check by the second checker, with the size of the proof."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in CONFIGS:
            full = name == "full_shift"
            made = Path(folder) / (f"{name}.h5" if full else f"{name}.certificate.h5")
            second = "check_full_shift" if full else "check_certificate"
            checks = (
                ["-m", "rigidpend", "run" if full else "certify", name, "--out", folder],
                ["-m", "rigidpend", "certify", "--check", str(made)],
                [str(ROOT / "scripts" / f"{second}.py"), str(made)],
            )
            asked = checks[:2] if name in LONG else checks
            times = [seconds(taken(partial(called, words))) for words in asked]
            times += ["-"] * (len(checks) - len(asked))
            rows.append((f"`{name}`", *times, f"{made.stat().st_size / 1e6:.2g} MB"))
    header = ("", "to prove", "to check again", "by the second checker", "proof")
    return Table("", header, rows)


def called(words: Sequence[str]) -> None:
    """Run Python with these words; what it says is of no interest unless it fails."""
    subprocess.run([sys.executable, *words], check=True, capture_output=True, cwd=ROOT)


@contextmanager
def dask(folder: str) -> Iterator[tuple[str, dict[str, int]]]:
    """A scheduler with one worker: its address, and the numbers of both processes."""
    file, running = Path(folder) / "scheduler.json", []
    words = ("scheduler", "--host", "127.0.0.1", "--port", "0"), ("worker", "--no-nanny")
    try:
        for name, *given in words:
            command = [sys.executable, "-m", "dask", name, *given, "--no-dashboard"]
            command += ["--scheduler-file", str(file)]
            command += ["--local-directory", folder] if name == "worker" else []
            running.append(subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL))
            while not (file.exists() and file.read_text().strip().endswith("}")):
                time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        yield address, {"scheduler": running[0].pid, "worker": running[1].pid}
    finally:
        for process in reversed(running):
            process.kill()
            process.wait()


def used_by(process: int) -> float:
    """Processor time of a process, in seconds."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100


def cluster_table() -> Table:
    """Times of a part that does nothing, for the scheduler, its worker and the run that gathers."""
    with tempfile.TemporaryDirectory() as folder, dask(folder) as (address, processes):

        def give(count: int) -> None:
            pieces = [Piece(str(k), dict) for k in range(count)]
            list(cluster.gathered(address, "route_codes", "taylor", pieces, tell_nobody))

        give(1)  # the worker imports what it needs
        before = {name: used_by(number) for name, number in processes.items()}
        gathering = taken(lambda: give(PARTS))
        rows = [
            (name, seconds((used_by(number) - before[name]) / PARTS))
            for name, number in processes.items()
        ]
    rows.append(("the run that gathers", seconds(gathering / PARTS)))
    return Table("", ("a part, beside its work", "time"), rows)


def tile(*settings: str) -> tuple[Callable[[], Any], int]:
    """What computes the whole plane of a config as one tile, and the number of its cells."""
    problem: Any = loading.load(MAP, [*SHARED, *settings]).content.problem
    x, y = (axis.values for axis in problem.planes[""])
    return lambda: compute._tile(x, y, problem, resolve(), 1), x.size * y.size


def cell_table() -> Table:
    """What a cell of 15 symbols costs, by maps that are kept already or with a body of its own."""
    return Table("", ("", "a cell"), list(_cell_rows()))


def _cell_rows() -> Iterator[tuple[str, str]]:
    work, cells = tile(*OWN_BODIES)
    yield "worker, each cell with a body of its own", seconds(taken(work) / cells)
    work, cells = tile(*BY_MAPS)
    tree = work()  # the maps are made now
    yield "worker, by kept maps", seconds(taken(work) / cells)
    with tempfile.TemporaryDirectory() as folder:
        said = (seconds(x / cells) for x in gathered(Path(folder) / "map.h5", tree))
        yield "the run that gathers: kept, read again, written", " + ".join(said)
        size = (Path(folder) / "map.h5").stat().st_size
        yield "traffic", f"{len(pickle.dumps(tree)) / cells:.2g} bytes"
        yield "file", f"{size / cells:.2g} bytes"


def gathered(target: Path, tree: Any) -> tuple[float, float, float]:
    """Seconds to keep a tile, to read it again, and to write the result of it."""
    parts = Parts(target, "measured")
    keep = partial(parts.keep, "tile", lambda: tree)
    kept, read = taken(keep), taken(keep)
    again = keep()
    fields = {name: PLANE[name] for name in again}
    written = taken(lambda: store.write(target, fields, again, {}, {}, {}))
    parts.drop()
    return kept, read, written


BLOCKS: dict[str, tuple[str, Callable[[], Table]]] = {
    "orbit times": ("docs/integration.md", orbit_table),
    "found times": ("docs/addresses.md", found_table),
    "proof times": ("docs/certified.md", proof_table),
    "cluster times": ("docs/cluster.md", cluster_table),
    "cell times": ("docs/cluster.md", cell_table),
}
"""Blocks of the pages, each with what measures it."""


def main() -> None:
    """Measure all, or some, and write the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("blocks", nargs="*", metavar="BLOCK", help="first words of blocks")
    machine = provenance()
    note = f"Time of processors; {machine['processor']}, {date.today().isoformat()}."
    asked = tuple(parser.parse_args().blocks)
    for block, (page, measured) in BLOCKS.items():
        if asked and not block.startswith(asked):
            continue
        table = measured()._replace(note=note)
        print("\n".join(markdown(table)), flush=True)
        write_table(ROOT / page, block, table)


if __name__ == "__main__":
    main()
