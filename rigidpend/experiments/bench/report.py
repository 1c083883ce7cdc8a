"""Tables of the benchmark: time, ratios and trust of every method, losses first.

Functions take ``/data`` of a result, as `store.load` gives it. Ratios at Fig. 4 come from the
meeting alone: the median over the rounds of a method's time divided by that of the default in the
same round.
"""

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench import TRUST
from rigidpend.experiments.bench.methods import DEFAULT, METHODS
from rigidpend.experiments.data import Data, Loaded
from rigidpend.machine.wording import Table, seconds, times

FIG4_TITLE = "route codes of Fig. 4, every symbol right"
RULE_OF_THREE = 3.0
"""Rule of three: an event absent in n trials has a chance of less than 3/n, at 95 %."""
COVERED = 0.95
"""Least probability with which a stated interval contains the true median."""
SLOWEST = 5
"""Number of listed bodies with which our method takes longest."""
CALLS = {"first call": "first", "again, an orbit": "again"}


class Standing(NamedTuple):
    """The outcome of the meeting for one method."""

    method: str
    seconds: float
    """Median over the rounds."""
    ratio: tuple[float, float, float]
    """Ratio of its time to the default's: the median over the rounds, and its :func:`interval`."""
    reached: bool
    """True if every symbol was right."""
    record: Any


def met(data: Data) -> list[Standing]:
    """Results of the methods at the meeting, fastest first; empty if the default was not there."""
    group = data["meeting"]
    found = []
    for name, record in records(group) if DEFAULT in group else ():
        ratios = record["rounds"] / group[DEFAULT]["rounds"]
        ratios = ratios[np.isfinite(ratios)]
        if ratios.size:
            right = not record["wrong_symbols"]
            middle = float(np.nanmedian(record["rounds"]))
            found.append(Standing(name, middle, interval(ratios), right, record))
    return sorted(found, key=lambda result: result.ratio[0])


def interval(sample: Any) -> tuple[float, float, float]:
    """A sample's median, and the ends of an interval that contains the true median.

    The ends are members of the sample, as far inside as a probability of `COVERED` allows: the
    number of n independent values below the true median is binomial as in n throws of a coin,
    whatever their distribution. Fewer than six values have no such interval; their range is
    returned, which contains the median with a probability of 1 - 2^(1-n).
    """
    ordered = np.sort(np.asarray(sample, dtype=float))
    n = ordered.size
    # Of n throws of a coin the chances of at most 0, 1, ... heads, or at most as many tails.
    missed = 2.0 ** (1 - n) * np.cumsum([float(math.comb(n, k)) for k in range(n)])
    k = int((missed[1:] <= 1 - COVERED).sum())
    return float(np.median(ordered)), float(ordered[k]), float(ordered[-1 - k])


def of_bodies(data: Data) -> dict[str, dict[str, Any]]:
    """Times of each method with the randomly drawn bodies, ours first.

    ``first`` is the first call with each body, in seconds, scaled to the number of orbits that ours
    followed; ``again`` the same call again, in seconds per orbit.
    """
    group = records(data.get("bodies", {}))
    found: dict[str, dict[str, Any]] = {}
    for name, record in group:
        again = record["again"] / record["orbits"]
        more = group[0][1]["orbits"] - record["orbits"]
        found[name] = {"first": record["first"] + more * again, "again": again}
    return found


def tables(result: Loaded) -> list[Table]:
    """All tables, losses first."""
    data = result["data"]
    rest = meeting_table(data), phases_table(data)
    return [losses_table(data), *bodies_tables(data), *(x for x in rest if x.rows)]


def losses_table(data: Data) -> Table:
    """Table of the losses: peers that are faster than ours, at Fig. 4 with every symbol right."""
    rows = [
        (FIG4_TITLE, METHODS[x.method].label, seconds(x.seconds), _stated(x.ratio))
        for x in met(data)
        if x.ratio[0] < 1 and x.reached and METHODS[x.method].peer
    ] + list(_lost_bodies(data))
    header = ("problem", "method", "time", "times ours")
    absent = [
        f"{METHODS[name].label}: {record['ended']}."
        for name, record in records(data["fig4"])
        if "seconds" not in record
    ]
    note = " ".join([*([] if rows else ["Nowhere in this run."]), *absent])
    return Table("Where another method is faster than ours", header, rows, note)


def _lost_bodies(data: Data) -> Iterator[tuple[str, ...]]:
    """Rows on bodies with which a peer is faster: their number, and the largest difference."""
    found = of_bodies(data)
    own = next(iter(found.values()), {})
    for name in (name for name in found if METHODS[name].peer):
        for call, key in CALLS.items():
            theirs = found[name][key]
            ratios = theirs / own[key]
            k, lost = int(np.argmin(ratios)), int((ratios < 1).sum())
            if lost:
                text = f"{call}: {lost} of {ratios.size} random bodies, the worst"
                yield text, METHODS[name].label, seconds(theirs[k]), times(ratios[k])


def bodies_tables(data: Data) -> list[Table]:
    """Tables of randomly drawn bodies: all methods, and the bodies that take ours longest."""
    found, group = of_bodies(data), data.get("bodies", {})
    if not found:
        return []
    (name, own), rows = next(iter(found.items())), []
    for method, took in found.items():
        cells = [METHODS[method].label]
        for key in CALLS.values():
            cells += map(seconds, np.quantile(took[key], (0.5, 0.9, 1)))
            cells.append(_stated(interval(took[key] / own[key])))
        rows.append([*cells, *_per_million(group[method])])
    header = (
        *("method", "first call", "90 %", "worst", "times ours"),
        *("again, an orbit", "90 %", "worst", "times ours", "wrong", "not decided"),
    )
    orbits = group[name]["orbits"]
    note = (
        f"{orbits.size} bodies: shapes, directions, energies, weights (mu/h0 from 1e-4 to 2e-2)"
        " and starts (J1_0 from 1e-12 to 1e-6) at random;"
        f" {max(orbits):,.0f} orbits of 15 symbols each, up to two threads; fewer with"
        f" {int((orbits < max(orbits)).sum())} of them,"
        " with which ours is expected to take long. A peer follows fewer,"
        " and its time is scaled. Medians over the bodies, then what 90 % of them stay below."
        " Symbols per million: wrong ones that a method vouches for, all wrong ones where it"
        " vouches for none. Where two methods differ, principal axes decide, in up to 113 bits;"
        " symbols after the first orbit that they have no time for do not count. heyoka is compiled"
        " once, with the numbers of a body as parameters."
    )
    slow = np.argsort(-sum(x / np.median(x) for x in own.values()))[:SLOWEST]
    title = f"The slowest bodies: {METHODS[name].label}"
    return [
        Table("Random bodies", header, rows, note),
        Table(title, ("A", "r", "mu/h0", "J1_0", *CALLS), [_body(group, own, k) for k in slow]),
    ]


def _body(group: Data, own: Data, k: int) -> tuple[str, ...]:
    """A row: a body, and the time that ours takes with it."""
    one = {key: x[k] for key, x in group.items() if np.ndim(x)}
    told = "({A1:.4g}, {A2:.4g}, {A3:.4g})", "({r1:.4g}, {r2:.4g}, 0)"
    weight = f"{one['mu'] / one['h0']:.2g}", f"{one['J1_0']:.2g}"
    return (*(x.format(**one) for x in told), *weight, *(seconds(x[k]) for x in own.values()))


def meeting_table(data: Data) -> Table:
    """Table of time and ratio of every method at Fig. 4, the fastest first."""
    rows = []
    for one in met(data):
        marks = " *" * (one.method == DEFAULT) + " +" * (not one.reached)
        wrong = float(one.record["wrong_symbols"])
        error = f"{wrong:.0f} symbols wrong" if wrong else f"{float(one.record['error']):.1e}"
        name = METHODS[one.method].label + marks
        rows.append((name, seconds(one.seconds), _stated(one.ratio), error))
    note = (
        "One thread, in turn in one process: medians, and in brackets an interval that holds the"
        f" true ratio with a chance of {100 * COVERED:.0f} % at least, were rounds independent (six"
        " or more). * with which the others are compared; + no setting that the search had time for"
        " had every symbol right."
    )
    return Table(FIG4_TITLE, ("method", "time", "times ours", "error"), rows, note)


def phases_table(data: Data) -> Table:
    """Table of wrong symbols per million on random phases, against 113-bit arithmetic."""
    groups = data["random_phases"]
    rows = []
    for name, _ in records(next(iter(groups.values()), {})):
        own = [group[name] for group in groups.values()]
        cells = ([*_per_million(x), seconds(float(x["seconds"] / x["orbits"]))] for x in own)
        rows.append([METHODS[name].label, *itertools.chain(*cells)])
    heads = [
        f"{x}, {start.replace('J1_0_', 'J1_0 = ')}"
        for start in groups
        for x in ("wrong", "not decided", "time per orbit")
    ]
    every = [record for group in groups.values() for record in group.values()]
    fewest = min((float(x["symbols"]) for x in every if not x["wrong_trusted"]), default=math.inf)
    note = (
        "Body and energy of Fig. 4, each method at its finest tolerance. Symbols per million; wrong"
        " ones that the method vouches for, and all wrong ones where it vouches for none. Truth:"
        " 113-bit arithmetic, 15 symbols an orbit. None wrong means, at 95 %, fewer than"
        f" {1e6 * RULE_OF_THREE / fewest:,.0f}, of {fewest:,.0f} symbols or more."
    )
    return Table("Random phases", ("method", *heads), rows, note)


def records(group: Data) -> list[tuple[str, Any]]:
    """The methods of a group with their records, in the order of `METHODS`."""
    return [(name, group[name]) for name in METHODS if name in group]


def _per_million(record: Data) -> list[str]:
    shares = (np.sum(record[name]) / np.sum(record["symbols"]) for name in TRUST)
    return [f"{1e6 * share:,.0f}" for share in shares]


def _stated(ratio: tuple[float, float, float]) -> str:
    middle, low, high = map(times, ratio)
    return "1" if ratio[1] == ratio[2] == 1 else f"{middle} ({low} to {high})"
