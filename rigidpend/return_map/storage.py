"""Storage of finished maps: one sealed file each, in the user's cache, named by its content.

The name is a digest of all that a map follows from: the body, the energies, the precision, the
design and this version of the code that builds. So a stored map is the one that would be built.
Numbers of any precision are stored as sums of doubles, without loss.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend import __version__
from rigidpend.body import Body
from rigidpend.integrate.compile_cache import user_cache
from rigidpend.integrate.pair_arrays import PairArray
from rigidpend.numbers.exact import Exact
from rigidpend.numbers.generic import Scalar
from rigidpend.results import files
from rigidpend.return_map.charts import Chart, ChartTable
from rigidpend.return_map.expansions import Interval
from rigidpend.return_map.normal_form import NormalForm
from rigidpend.return_map.precision import Precision, precision
from rigidpend.run.provenance import code_hash_of

MOST = 200_000_000
"""Bytes of all kept maps; one over the energies of Fig. 4 takes half a million."""


def name_of(body: Body, low: Exact, high: Exact, bits: int, design: Any, table: int) -> str:
    """The digest of what a map follows from, the precision of its tables among it."""
    parts = [__version__, _code(), *map(str, (*body.A, *body.r, body.mu, low, high))]
    parts += [str(bits), json.dumps(tuple(design)), str(table)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


@functools.cache
def _code() -> str:
    """The hash of the code that builds maps, and of all that it imports of the package."""
    return code_hash_of(Path(__file__).with_name("build.py"))


def save(name: str, nf: NormalForm, charts: tuple[Chart, Chart], facts: dict[str, Any]) -> None:
    """Keep a map; where the cache cannot be written nothing is kept."""
    arrays = {f"nf_{k}": _split(x) for k, x in _numbers(nf).items()}
    for rising, chart in enumerate(charts):
        for which, table in zip(Chart._fields, chart, strict=True):
            arrays[f"{which}_{rising}"] = _split(table.values)
            arrays[f"{which}_{rising}_width"] = _split(table.width)
    sizes = [[[table.n_x, table.n_phase] for table in chart] for chart in charts]
    text = {
        "nf": [nf.degree, nf.n, nf.energies.n, nf.radius, nf.disagreement],
        "sizes": sizes,
        **facts,
    }
    content = io.BytesIO()
    np.savez(content, text=np.array(json.dumps(text)), **arrays)
    with contextlib.suppress(OSError):
        path = _path(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        files.replace(path, files.sealed(content.getvalue()), lasting=False)
        bound(path.parent)


def bound(folder: Path, most: int = MOST) -> None:
    """Remove the maps used longest ago until the rest take at most `most` bytes."""
    known = [(path, path.stat()) for path in folder.glob("*.npz")]
    total = sum(stat.st_size for _, stat in known)
    for path, stat in sorted(known, key=lambda one: one[1].st_mtime_ns):
        if total <= most:
            break
        path.unlink(missing_ok=True)
        total -= stat.st_size


def load(name: str, bits: int) -> tuple[NormalForm, tuple[Chart, Chart], dict[str, Any]] | None:
    """A map that was kept; None where there is none, or its file is damaged."""
    try:
        content = files.unsealed(_path(name).read_bytes())
    except OSError:
        return None
    with contextlib.suppress(OSError):
        # The time of its last use, by which the folder is kept small.
        os.utime(_path(name))
    if content is None:
        return None
    a = precision(bits)
    with np.load(io.BytesIO(content)) as stored:
        text = json.loads(str(stored["text"]))
        take = {key: _joined(stored[key], a) for key in stored.files if key != "text"}
    degree, n, count, *measured = text.pop("nf")
    sizes = text.pop("sizes")
    energies = Interval(take["nf_centre"][()], take["nf_half_width"][()], count)
    nf = NormalForm(
        energies,
        degree,
        n,
        *(take[f"nf_{k}"] for k in ("odd", "even", "exponent", "rotation")),
        *measured,
    )
    charts = []
    for rising in (0, 1):
        tables = []
        for which, (n_x, n_phase) in zip(Chart._fields, sizes[rising], strict=True):
            key = f"{which}_{rising}"
            tables.append(ChartTable(take[f"{key}_width"][()], n_x, n_phase, take[key]))
        charts.append(Chart(*tables))
    return nf, (charts[0], charts[1]), text


def _numbers(nf: NormalForm) -> dict[str, Any]:
    found = {k: getattr(nf, k) for k in ("odd", "even", "exponent", "rotation")}
    return {**found, "centre": nf.energies.centre, "half_width": nf.energies.half_width}


def _path(name: str) -> Path:
    return user_cache() / "rigidpend" / "maps" / f"{name}.npz"


def _split(x: Scalar) -> Any:
    """Numbers of any precision as a sum of doubles, (terms, ...)."""
    if isinstance(x, PairArray):
        return x.parts
    rest = np.asarray(x)
    parts: list[Any] = []
    while not parts or np.any(parts[-1]):
        parts.append(np.asarray(rest.astype(float)))
        rest = np.asarray(rest - parts[-1].astype(rest.dtype))
    return np.stack(parts[:-1] or parts)


def _joined(parts: Any, a: Precision) -> Any:
    """The numbers that :func:`_split` has split, for the last part first."""
    if a.in_pairs:
        return PairArray(parts)
    total = a.array(parts[-1])
    for part in parts[-2::-1]:
        total = a.array(part) + total
    return np.asarray(total)
