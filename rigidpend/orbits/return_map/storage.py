"""Storage of finished maps: one file each, in the user's cache, with all that it follows from.

That is the body, the energies, the precision, the design and this version of the code that
builds. It is compared when a map is read, so a stored map is the one that would be built. Numbers
of any precision are stored as sums of doubles, without loss.
"""

from __future__ import annotations

import functools
import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend import __version__
from rigidpend.machine import cache
from rigidpend.machine.code_hash import code_hash_of
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import Exact
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.pair_arrays import PairArray
from rigidpend.orbits.return_map.charts import Chart, Charts, ChartTable
from rigidpend.orbits.return_map.expansions import Interval
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.precision import Precision, precision

MOST = 500_000_000
"""Bytes of all kept maps: one of Fig. 4 takes half a million, of a nearly symmetric body 50."""


def followed(body: Body, low: Exact, high: Exact, bits: int, design: Any, table: int) -> bytes:
    """All that a map follows from, the precision of its tables among it."""
    parts = [__version__, _code(), *map(str, (*body.A, *body.r, body.mu, low, high))]
    parts += [str(bits), json.dumps(tuple(design)), str(table)]
    return "\n".join(parts).encode()


@functools.cache
def _code() -> str:
    """The hash of the code that builds maps, and of all that it imports of the package."""
    return code_hash_of(Path(__file__).with_name("build.py"))


def save(
    of: bytes,
    nf: NormalForm,
    charts: Charts,
    facts: dict[str, Any],
) -> None:
    """Keep a map with what it follows from."""
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
    cache.save(_folder(), of, content.getvalue(), MOST)


def save_refusal(of: bytes, facts: dict[str, Any]) -> None:
    """Keep why there is no map, with what that follows from."""
    content = io.BytesIO()
    np.savez(content, text=np.array(json.dumps({"nf": None, **facts})))
    cache.save(_folder(), of, content.getvalue(), MOST)


def load(of: bytes, bits: int) -> tuple[NormalForm | None, Any, dict[str, Any]] | None:
    """The normal form and the charts of the map that was kept, and the facts.

    The facts alone where a refusal was kept; None where there is nothing that fits.
    """
    content = cache.load(_folder(), of)
    if content is None:
        return None
    a = precision(bits)
    with np.load(io.BytesIO(content)) as stored:
        text = json.loads(str(stored["text"]))
        take = {key: _joined(stored[key], a) for key in stored.files if key != "text"}
    sizes_of_nf = text.pop("nf")
    if sizes_of_nf is None:
        return None, None, text
    degree, n, count, *measured = sizes_of_nf
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


def _folder() -> Path:
    return cache.folder() / "maps"


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
