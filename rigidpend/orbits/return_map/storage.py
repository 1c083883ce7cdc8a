"""Return maps on request: from memory, from disk, or built; or the reason why there is none.

A map is kept in one file of the user's cache, with all that it follows from: the body, the
energies, the precision, the design and the package's code. These are compared when a map is read,
so that a stored map is the one that would be built. Numbers of any precision are stored as sums of
doubles, without loss.
"""

import functools
import io
import json
import math
import threading
from collections.abc import Callable, Iterator, Sequence
from numbers import Real
from typing import Any, TypeAlias

import numpy as np

from rigidpend.machine import cache
from rigidpend.machine.code_hash import package_digest
from rigidpend.machine.workers import WorkerError, apart
from rigidpend.mechanics.body import Body, check_units
from rigidpend.numbers import Scalar, checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import FINEST_BITS, Exact
from rigidpend.numbers.texts import named
from rigidpend.orbits.integrate.sum_arrays import SumArray
from rigidpend.orbits.precision import Precision, precision
from rigidpend.orbits.return_map.build import WITH_THETA3, Costly, Design, ReturnMap, build, plan
from rigidpend.orbits.return_map.charts import Chart
from rigidpend.orbits.return_map.checks import Errors
from rigidpend.orbits.return_map.expansions import Interval
from rigidpend.orbits.return_map.midline import Midline
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm
from rigidpend.orbits.return_map.orders import Orders
from rigidpend.orbits.return_map.tables import ChartTable

MOST_BYTES = 500_000_000
"""Bytes of all kept maps.

One of the body of Fig. 4 takes half a million, one of a nearly symmetric body 50 million."""
Make: TypeAlias = Callable[..., ReturnMap]
"""Function that builds a map, with the arguments of :func:`build`."""
RECORDS = {
    x.__name__: x for x in (NormalForm, Interval, Chart, ChartTable, Midline, Orders, Errors)
}
"""Kinds of records in a stored map, by their names."""


def return_map(
    body: Body,
    *,
    h: Scalar,
    bits: int = 53,
    design: Design = WITH_THETA3,
    budget: float = math.inf,
) -> ReturnMap:
    """The return map of a body, built or taken from the cache.

    Parameters
    ----------
    body : Body
    h : number or pair of numbers
        The energy (eq. h0_new), physical units, as mu, or the least and the largest.
        Text, Fraction and Decimal are exact; a float is taken as the double that it is.
    bits : int, optional
        Precision: 53, 64 or any other from 53 on. Beyond 96 a map takes minutes to build.
    design : Design, optional
        Another design gives an independent map of the same orbits.
    budget : float, optional
        Largest expected time of building, seconds of a core. A refusal follows from the body alone,
        and neither from the machine nor from the maps that are kept.

    Returns
    -------
    ReturnMap

    Raises
    ------
    MapError
        No map resolves the orbits: the periodic orbit is elliptic, mu is too large, a multiplier
        is negative; the message gives the reason. Or building takes more than the budget.
    ParameterError
        The energies are no numbers, do not ascend or are far from 1; or bits are not from 53 to
        `FINEST_BITS`.

    Examples
    --------
    >>> body = Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.001")
    >>> level = return_map(body, h="1.3342").at(1.3342)
    """
    checked.of_kind("body", body, Body)
    checked.of_kind("design", design, Design)
    checked.of_kind("budget", budget, Real)
    bits = checked.whole("bits", bits, 53, FINEST_BITS)
    ends = list(h) if isinstance(h, (tuple, list)) else [h, h]
    if len(ends) != 2:
        raise ParameterError("h", f"h must be an energy or a pair of energies, got {named(h)}")
    low, high = (checked.number("h", x) for x in ends)
    if float(high - low) < 0:
        raise ParameterError("h", f"the energies must ascend, got {low} and {high}")
    for end in (low, high):
        check_units("h", end)
    return kept_map(body, low, high, bits, design).within(budget)


def is_kept(body: Body, low: Exact, high: Exact, bits: int, design: Design) -> bool:
    """True if a map was built before, by this or another process, and can be used."""
    return isinstance(kept_map(body, low, high, bits, design).known, ReturnMap)


def build_apart(
    body: Body, ends: Sequence[Exact], bits: int, design: Design, budget: float
) -> None:
    """Build a map in a process of its own, unless it is known; raises as :func:`return_map`.

    Threads would not gain time: most of it is spent in the interpreter, which they share.
    """
    low, high = ends
    kept_map(body, low, high, bits, design).within(budget, _by_process)


def _by_process(*task: Any) -> ReturnMap:
    """Build a map in a process of its own, or in this one if there can be none."""
    *which, _ = task
    # The looks at the body are taken in this process, where maps of all designs share them.
    task = *task, plan(*which)
    try:
        return apart(build, task)
    except (WorkerError, OSError, ImportError, NotImplementedError):
        # The process was killed, or the system allows no processes or no channel to them.
        return build(*task)


class _Kept:
    """A map, or the reason why there is none, in memory and on disk."""

    def __init__(self, body: Body, low: Exact, high: Exact, bits: int, design: Design) -> None:
        self._task = body, low, high, bits, design
        self._of = map_key(*self._task)
        self._lock, self.known = threading.Lock(), self._stored()

    def within(self, budget: float, make: Make | None = None) -> ReturnMap:
        """The map, if it can be built within a budget; otherwise MapError is raised."""
        # If threads ask for the same map, one makes it while the others wait.
        with self._lock:
            known = self.known
            if known is None or (isinstance(known, Costly) and known.needed <= budget):
                self.known = known = self._made(make or build, budget)
        # Known refusals are raised as new exceptions: one that is kept would gather the traces of
        # all its raises. A map that is kept is refused for a budget as one to be built.
        if isinstance(known, Costly):
            raise Costly(known.needed, budget)
        if isinstance(known, MapError):
            raise MapError(str(known))
        if known.cost > budget:
            raise Costly(known.cost, budget)
        return known

    def _made(self, make: Make, budget: float) -> ReturnMap | MapError:
        """The map, or the reason why there is none, made and stored."""
        try:
            made = make(*self._task, budget)
        except MapError as refused:
            needed = refused.needed if isinstance(refused, Costly) else None
            self._save([str(refused), needed])
            return refused
        parts = made.normal_form, *made.charts, *made.midlines, made.orders, made.errors, made.cost
        self._save(list(parts))
        return made

    def _save(self, facts: list[Any]) -> None:
        """Store records and numbers in one file: their arrays, and JSON that describes them."""
        arrays: list[Any] = []
        text = json.dumps([_described(x, arrays) for x in facts])
        content = io.BytesIO()
        np.savez(content, *arrays, text=np.array(text))
        cache.save(cache.folder() / "maps", self._of, content.getvalue(), MOST_BYTES)

    def _stored(self) -> ReturnMap | MapError | None:
        """The map or the reason that is stored; None if there is neither."""
        body, low, high, bits, design = self._task
        content = cache.load(cache.folder() / "maps", self._of)
        if content is None:
            return None
        a = precision(bits)
        with np.load(io.BytesIO(content)) as stored:
            parts = (stored[f"arr_{k}"] for k in range(len(stored.files) - 1))
            facts = [_restored(x, parts, a) for x in json.loads(str(stored["text"]))]
        # A reason, with the least time if a budget was the reason; else the parts of a map.
        if len(facts) == 2:
            reason, needed = facts
            return MapError(reason) if needed is None else Costly(needed, 0.0)
        nf, down, up, *lines, orders, errors, cost = facts
        ends = low, high
        # Midlines are doubles whatever the precision of the map.
        low_line, up_line = (Midline(a.floats(line.values)) for line in lines)
        return ReturnMap(
            body, bits, ends, errors, orders, design, nf, (down, up), (low_line, up_line), cost
        )


kept_map = functools.lru_cache(maxsize=16)(_Kept)
"""The one :class:`_Kept` of a map, of those that were asked for last."""


def map_key(body: Body, low: Exact, high: Exact, bits: int, design: Design) -> bytes:
    """All that a map follows from, as text: the key under which it is stored."""
    parts = [package_digest(), *(str(x.key) for x in (*body.A, *body.r, body.mu, low, high))]
    parts += [str(bits), json.dumps(tuple(design))]
    return "\n".join(parts).encode()


def _described(x: Any, arrays: list[Any]) -> Any:
    """A value as JSON: a record as its name and fields; arrays go to a list, in their order."""
    if type(x).__name__ in RECORDS:
        return [type(x).__name__, *(_described(each, arrays) for each in x)]
    if x is None or isinstance(x, (str, int, float)):
        return x
    # Terms of high degree have few orders in energy and phase: zeros, which are told by bits.
    parts = as_doubles(x)
    used = parts.any(axis=0)
    arrays += [np.packbits(used), parts[:, used]]
    return {"shape": used.shape}


def _restored(x: Any, arrays: Iterator[Any], a: Precision) -> Any:
    """The value that was described, with the next of the arrays wherever there was one."""
    if isinstance(x, list):
        return RECORDS[x[0]](*(_restored(each, arrays, a) for each in x[1:]))
    if not isinstance(x, dict):
        return x
    bits, shape = next(arrays), x["shape"]
    used = np.unpackbits(bits, count=math.prod(shape)).reshape(shape).astype(bool)
    kept = next(arrays)
    parts = np.zeros((len(kept), *shape))
    parts[:, used] = kept
    return from_doubles(parts, a)[()]


def as_doubles(x: Scalar) -> Any:
    """Numbers of any precision as exact sums of doubles, (terms, ...), the largest first."""
    if isinstance(x, SumArray):
        return x.parts
    # Each double takes 53 bits of the rest, whose subtraction is exact, until nothing is left; the
    # last part is zero.
    rest = np.asarray(x)
    parts: list[Any] = []
    while not parts or np.any(parts[-1]):
        parts.append(np.asarray(rest.astype(float)))
        rest = np.asarray(rest - parts[-1].astype(rest.dtype))
    return np.stack(parts[:-1] or parts)


def from_doubles(parts: Any, a: Precision) -> Any:
    """The numbers of a precision that :func:`as_doubles` has made parts of."""
    if a.parts > 1:
        return SumArray(parts)
    # Each partial sum is a number of the precision, without a rounding.
    return np.asarray(sum(map(a.array, parts)))
