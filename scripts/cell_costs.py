"""What a cell of a code map costs a core: computed, kept, read again and written."""

from __future__ import annotations

import pickle
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rigidpend.experiments.route_map import PLANE, compute
from rigidpend.machine.wording import Table, seconds
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.results import store
from rigidpend.runs import loading
from rigidpend.runs.parts import Parts
from scripts.readme_tables import ROOT

CONFIG = ROOT / "configs" / "route_map.yaml"
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


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds of the processor that work takes, and what comes of it."""
    begun = time.process_time()
    found = work()
    return time.process_time() - begun, found


def tile(*settings: str) -> tuple[Callable[[], Any], int]:
    """What computes the whole plane of a config as one tile, and the number of its cells."""
    problem: Any = loading.load(CONFIG, [*SHARED, *settings]).content.problem
    x, y = (axis.values for axis in problem.planes[""])
    return lambda: compute._tile(x, y, problem, resolve(), 1), x.size * y.size


def cell_table() -> Table:
    """What a cell of 15 symbols costs, by maps that are kept already or with a body of its own."""
    return Table("", ("", "a cell"), list(_rows()))


def _rows() -> Iterator[tuple[str, str]]:
    work, cells = tile(*OWN_BODIES)
    took, _ = timed(work)
    yield "worker, each cell with a body of its own", seconds(took / cells)
    work, cells = tile(*BY_MAPS)
    work()  # the maps are made now
    took, tree = timed(work)
    yield "worker, by kept maps", seconds(took / cells)
    with tempfile.TemporaryDirectory() as folder:
        said = (seconds(x / cells) for x in gathered(Path(folder) / "map.h5", tree))
        yield "the run that gathers: kept, read again, written", " + ".join(said)
        size = (Path(folder) / "map.h5").stat().st_size
        yield "traffic", f"{len(pickle.dumps(tree)) / cells:.2g} bytes"
        yield "file", f"{size / cells:.2g} bytes"


def gathered(target: Path, tree: Any) -> tuple[float, float, float]:
    """Seconds to keep a tile, to read it again, and to write the result of it."""
    parts = Parts(target, "measured")
    kept, _ = timed(lambda: parts.keep("tile", lambda: tree))
    read, again = timed(lambda: parts.keep("tile", lambda: tree))
    fields = {name: PLANE[name] for name in again}
    written, _ = timed(lambda: store.write(target, fields, again, {}, {}, {}))
    parts.drop()
    return kept, read, written
