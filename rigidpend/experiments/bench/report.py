"""Time, ratios and trust of every method, losses first.

Functions take ``/data`` of a result, as `store.load` gives it. Infinity stands for what no
measurement reached. Ratios come from the meetings alone: the median over the rounds of a method's
time divided by that of the default in the same round.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench import methods
from rigidpend.experiments.bench.methods import METHODS, OWN, PROBLEMS
from rigidpend.experiments.data import Data, Loaded
from rigidpend.machine.wording import Table, seconds, times
from rigidpend.numbers.generic import Scalar

CAPTION = (
    "With bodies drawn by lot as with those of the figures: who is faster at equal error, and how"
    " many of the symbols that a method vouches for are wrong. Every method is used as its own"
    " documentation does, on one machine."
)
LEVELS = (1e-3, 1e-6, 1e-9, 1e-12)
RULE_OF_THREE = 3.0
"""Rule of three: an event absent in n trials has a chance of less than 3/n, at 95 %."""
COVERED = 0.95
"""Least chance with which a stated interval holds the true median."""
MAPS = "route_codes_map"
"""The method of return maps."""
SLOWEST = 5
"""Number of bodies that are told, those with which ours takes longest."""


class Standing(NamedTuple):
    """The outcome of a meeting for one method."""

    method: str
    seconds: float
    """Median over the rounds, for the whole problem."""
    ratio: float
    """Ratio of its time to the default's: the median over the rounds."""
    low: float
    """Ends of the interval of :func:`interval` of that ratio."""
    high: float
    reached: bool
    """True if the method reached the level of the problem."""
    record: Any


def met(data: Data, problem: str, threads: int, default: str = "") -> list[Standing]:
    """Results of the methods at a meeting, the fastest first; empty where there was none.

    Ratios are to the default of the problem, or to another one.
    """
    group = data.get("meetings", {}).get(f"threads_{threads}", {}).get(problem, {})
    own = group.get(default or str(data[problem]["default"]))
    found = []
    for name in _measured(group) if own else ():
        ratios = group[name]["rounds"] / own["rounds"]
        ratios = ratios[np.isfinite(ratios)]
        if ratios.size:
            median = float(np.nanmedian(group[name]["rounds"]))
            reached = bool(methods.good_enough(problem, group[name]))
            ratio = float(np.median(ratios)), *interval(ratios)
            found.append(Standing(name, median, *ratio, reached, group[name]))
    return sorted(found, key=lambda result: result.ratio)


def interval(sample: Any) -> tuple[float, float]:
    """The stated uncertainty of a median: an interval that holds the true one.

    Its ends are members of the sample, as far inside as leaves a chance of `COVERED` at least: so
    many of n independent values are less than the median as heads fall in n throws of a coin,
    whatever their distribution. Fewer than six values have no such interval; it is their range
    then, which holds the median with a chance of 1 - 2^(1-n).
    """
    ordered = np.sort(np.asarray(sample, dtype=float))
    n, k, missed = ordered.size, 0, 2.0 ** (1 - ordered.size)
    while (missed := missed + 2.0 ** (1 - n) * math.comb(n, k + 1)) <= 1 - COVERED:
        k += 1
    return float(ordered[k]), float(ordered[-1 - k])


def losses(data: Data) -> list[tuple[str, int, Standing]]:
    """Losses: problems at which a peer needs less time than the default, at their level."""
    return [
        (problem, threads, result)
        for problem in _problems(data)
        for threads in _threads(data)
        for result in met(data, problem, threads)
        if result.ratio < 1 and result.reached and METHODS[result.method].family not in OWN
    ]


def time_to_reach(record: Data, level: float) -> float:
    """The shortest of the times in which a method got an error of `level` or less.

    Over long times only what went all the way counts.
    """
    if "error" not in record:
        return math.inf
    enough = (np.nan_to_num(record["error"], nan=math.inf) <= level) & (record["part"] == 1)
    return float(min(record["seconds"][enough], default=math.inf))


def tables(result: Loaded) -> list[Table]:
    """All tables, for people: losses first."""
    data = result["data"]
    found = [losses_table(data)]
    found += [bodies_table(data), slowest_table(data)] if data.get("bodies") else []
    for problem in _problems(data):
        found += [meeting_table(data, problem)] if met(data, problem, 1) else []
    found += [cross_checks_table(data)] if "codes" in data else []
    found += [phases_table(data)] if data.get("random_phases") else []
    found += [many_table(data)] if data.get("many_orbits") else []
    return found + [search_table(data, problem) for problem in _problems(data)]


def losses_table(data: Data) -> Table:
    """Table of the losses: a peer is faster than the default."""
    rows = [
        (
            str(data[problem]["title"]),
            METHODS[result.method].label,
            str(threads),
            seconds(result.seconds),
            _spread(result),
        )
        for problem, threads, result in losses(data)
    ] + list(_lost_bodies(data))
    header = ("problem", "method", "threads", "time", "times ours")
    note = "" if rows else "Nowhere in this run."
    return Table("Where another method is faster than ours", header, rows, note)


def of_bodies(data: Data) -> dict[str, dict[str, Any]]:
    """Times of each method with the bodies drawn by lot, ours first.

    ``first`` is the first call with each body, seconds, scaled to as many orbits as ours followed;
    ``again`` the same call again, seconds an orbit.
    """
    group: Data = data.get("bodies", {})
    found: dict[str, dict[str, Any]] = {}
    for name in _measured(group):
        record, own = group[name], group[next(iter(found), name)]
        again = record["again"] / record["orbits"]
        first = record["first"] + (own["orbits"] - record["orbits"]) * again
        found[name] = {"first": first, "again": again}
    return found


CALLS = {"first call": "first", "again, an orbit": "again"}


def _lost_bodies(data: Data) -> Iterator[tuple[str, ...]]:
    """Bodies with which a peer is faster: how many, and the one with which it is so by most."""
    found = of_bodies(data)
    for name in (name for name in found if METHODS[name].family not in OWN):
        own = next(iter(found.values()))
        for call, key in CALLS.items():
            theirs = found[name][key]
            ratios = theirs / own[key]
            k, lost = int(np.argmin(ratios)), int((ratios < 1).sum())
            if lost:
                text = f"{call}: {lost} of {ratios.size} bodies drawn by lot, the worst"
                label = METHODS[name].label
                yield text, label, "2", seconds(float(theirs[k])), times(float(ratios[k]))


def bodies_table(data: Data) -> Table:
    """First call, and again, of every method with bodies drawn by lot; symbols that are wrong."""
    found, rows = of_bodies(data), []
    own = next(iter(found))
    for name in found:
        cells, record = [METHODS[name].label], data["bodies"][name]
        for key in CALLS.values():
            theirs, ours = found[name][key], found[own][key]
            cells += [seconds(float(x)) for x in np.quantile(theirs, (0.5, 0.9, 1))]
            cells.append(_stated(np.median(theirs / ours), *interval(theirs / ours)))
        shares = (record[key].sum() / record["symbols"].sum() for key in TRUST)
        rows.append([*cells, *(f"{1e6 * float(share):,.0f}" for share in shares)])
    header = (
        *("method", "first call", "90 %", "worst", "times ours"),
        *("again, an orbit", "90 %", "worst", "times ours", "wrong", "not decided"),
    )
    orbits = data["bodies"][own]["orbits"]
    slow = int((orbits < max(orbits)).sum())
    note = (
        f"{orbits.size} bodies: shapes, directions, energies, weights (mu/h0 from 1e-4 to 2e-2)"
        " and starts (J1_0 from 1e-12 to 1e-6) by lot;"
        f" {max(orbits):,.0f} orbits of 15 symbols each, up to two threads; fewer of the"
        f" {slow} bodies"
        " with which ours is expected to take long. A peer follows fewer,"
        " and its time is scaled. Medians over the bodies, then what 90 % of them stay below."
        " Symbols per million: wrong ones that a method vouches for, all wrong ones where it"
        " vouches for none. Where two methods differ principal axes tell, in up to 113 bits; what"
        " is behind the first orbit that they have no time for does not count. heyoka is compiled"
        " once, with the numbers of a body as parameters."
    )
    return Table("Bodies drawn by lot", header, rows, note)


TRUST = ("wrong_trusted", "undecided")


def slowest_table(data: Data) -> Table:
    """The bodies with which ours takes longest, in the first call or again."""
    (name, own), group = next(iter(of_bodies(data).items())), data["bodies"]
    slow = np.argsort(-sum(x / np.median(x) for x in own.values()))
    rows = []
    for k in slow[:SLOWEST]:
        one = {key: float(x[k]) for key, x in group.items() if np.ndim(x)}
        A, r = (
            ", ".join(f"{one[key]:.4g}" for key in keys)
            for keys in (("A1", "A2", "A3"), ("r1", "r2"))
        )
        told = f"({A})", f"({r}, 0)", f"{one['mu'] / one['h0']:.2g}", f"{one['J1_0']:.2g}"
        rows.append((*told, *(seconds(float(own[key][k])) for key in CALLS.values())))
    header = ("A", "r", "mu/h0", "J1_0", *CALLS)
    return Table(f"The slowest bodies: {METHODS[name].label}", header, rows)


def meeting_table(data: Data, problem: str) -> Table:
    """Time and ratio of every method at a problem, the fastest first; one thread, then more."""
    counts = _threads(data)
    by_count = {count: {r.method: r for r in met(data, problem, count)} for count in counts}
    first = next(iter(by_count.values()))
    rows = []
    for name, result in first.items():
        cells = [METHODS[name].label + _marks(data, problem, result)]
        for count in counts:
            there = by_count[count].get(name)
            cells += [seconds(there.seconds), _spread(there)] if there else ["-", "-"]
        rows.append((*cells, _error(result)))
    heads = [x for n in counts for x in (_threads_text(n), "times ours")]
    note = (
        "In turn in one process: medians, and in brackets an interval that holds the true ratio "
        f"with a chance of {100 * COVERED:.0f} % at least, were rounds independent (six or more). "
        "Of two threads a method takes one where that is faster. "
        "* what rigidpend picks; + did not reach the level."
    )
    return Table(level_text(data, problem), ("method", *heads, "error"), rows, note)


def cross_checks_table(data: Data) -> Table:
    """Table of the cost of trust at the codes of Fig. 4: methods that vouch for symbols."""
    rows = []
    for result in met(data, "codes", 1, "route_codes"):
        if METHODS[result.method].certain:
            told = (f"{float(result.record[name]):.0f}" for name in ("undecided", "wrong_trusted"))
            times_ours = times(result.ratio)
            rows.append((METHODS[result.method].label, seconds(result.seconds), times_ours, *told))
    header = ("cross-check", "time", "times route_codes", "not decided", "wrong, trusted")
    note = "A peer's user runs twice, compares, and runs a third time where the two differ."
    return Table("Cross-check against cross-check, codes of Fig. 4, one thread", header, rows, note)


def phases_table(data: Data) -> Table:
    """Wrong symbols per million on random phases, against 113-bit arithmetic."""
    groups = data["random_phases"]
    names = [name for name in METHODS if any(name in group for group in groups.values())]
    rows = []
    for name in names:
        cells = [METHODS[name].label]
        for group in groups.values():
            record = group.get(name)
            cells += _per_million(record) if record else ["-"] * 3
        rows.append(cells)
    heads = [
        f"{x}, {start.replace('_', ' ', 1).replace('J1 0_', 'J1_0 = ')}"
        for start in groups
        for x in ("wrong", "not decided", "time per orbit")
    ]
    every = [record for group in groups.values() for record in group.values()]
    fewest = min((float(x["symbols"]) for x in every if not x["wrong_trusted"]), default=math.inf)
    note = (
        "Symbols per million; wrong ones that the method vouches for, and all wrong ones where it "
        "vouches for none. Truth: 113-bit arithmetic, 15 symbols an orbit. None wrong means, at "
        f"95 %, fewer than {1e6 * RULE_OF_THREE / fewest:,.0f}, of {fewest:,.0f} symbols or more."
    )
    return Table("Random phases", ("method", *heads), rows, note)


def many_table(data: Data) -> Table:
    """Time of each method against the number of orbits, in units of that of return maps too."""
    group = data["many_orbits"]
    numbers = many_numbers(data)
    most = numbers[-1]
    own = scaled(group[MAPS], most)[0] if MAPS in group else math.nan
    rows = []
    for name in _measured(group):
        found = [scaled(group[name], number) for number in numbers]
        cells = [
            seconds(taken) + (" ~" if orbits < number else "")
            for (taken, _, orbits), number in zip(found, numbers, strict=True)
        ]
        undecided = f"{float(group[name]['undecided'][-1]):.0f}" if METHODS[name].certain else "-"
        taken, prepare, _ = found[-1]
        cells += [seconds(prepare), times(taken / own), undecided]
        rows.append((METHODS[name].label, *cells))
    header = (
        "method",
        *(f"{number:,.0f}" for number in numbers),
        "to prepare",
        f"times maps, {most:,.0f}",
        "not decided",
    )
    note = (
        "Orbits from random phases, 15 symbols each in the record, warm. To prepare: tables of the "
        "maps and compilation, once. ~ scaled from fewer orbits."
    )
    return Table("Time against the number of orbits, one thread", header, rows, note)


def many_numbers(data: Data) -> list[float]:
    """Numbers of orbits that any method was timed with, ascending, without those of the slow."""
    group = data["many_orbits"]
    longest = max((record["orbits"] for record in group.values()), key=len)
    return [float(number) for number in longest]


def scaled(record: Data, number: float) -> tuple[float, float, float]:
    """The time of a method for a number of orbits, what it took to prepare, and its own number.

    The time is warm, what is made ready once being there, and scaled from the number of orbits
    that was timed.
    """
    orbits, prepare = np.asarray(record["orbits"]), np.cumsum(record["prepare"])
    k = int(np.flatnonzero(orbits <= number).max(initial=0))
    taken = float(record["seconds"][k]) * number / float(orbits[k])
    return taken, float(prepare[k]), float(orbits[k])


def search_table(data: Data, problem: str) -> Table:
    """Time to reach an error, of every method alone."""
    group = data[problem]
    rows = []
    for name in _measured(group):
        record = group[name]
        cells = [seconds(time_to_reach(record, level)) for level in LEVELS]
        prepare = float(np.max(record["prepare"])) if "prepare" in record else math.inf
        ended = str(record["ended"])
        said = "" if ended == "complete" else ended
        rows.append((METHODS[name].label, *cells, seconds(prepare), said))
    header = ("method", *(f"{level:.0e}" for level in LEVELS), "to prepare", "ended")
    caption = f"{group['title']}: time to reach an error, each method alone"
    return Table(caption, header, rows, f"Error: {group['error']}.")


def summary(data: Data) -> dict[str, Any]:
    """All of it as plain data, for JSON: None where nothing was reached."""
    lost = [
        {"problem": problem, "threads": threads, **result._asdict()}
        for problem, threads, result in losses(data)
    ]
    standings = {
        problem: {
            str(count): [result._asdict() for result in met(data, problem, count)]
            for count in _threads(data)
        }
        for problem in _problems(data)
    }
    found: dict[str, Any] = _plain({"losses": lost, "met": standings, **data})
    return found


def level_text(data: Data, problem: str) -> str:
    """Name a problem with the level at which methods meet."""
    level = PROBLEMS[problem].level
    goal = "every symbol right" if level is None else f"to an error of {level:.0e}"
    return f"{data[problem]['title']}, {goal}"


def _per_million(record: Data) -> list[str]:
    shares = (float(record[name]) / float(record["symbols"]) for name in TRUST)
    cost = seconds(float(record["seconds"]) / float(record["orbits"]))
    return [*(f"{1e6 * share:,.0f}" for share in shares), cost]


def _marks(data: Data, problem: str, result: Standing) -> str:
    marks = " *" if result.method == str(data[problem]["default"]) else ""
    return marks + " +" * (not result.reached)


def _spread(result: Standing) -> str:
    return _stated(result.ratio, result.low, result.high)


def _stated(middle: Scalar, low: float, high: float) -> str:
    if low == high == 1:
        return "1"
    return f"{times(float(middle))} ({times(low)} to {times(high)})"


def _error(result: Standing) -> str:
    wrong = float(result.record["wrong_symbols"]) if "wrong_symbols" in result.record else 0.0
    return f"{wrong:.0f} symbols wrong" if wrong else f"{float(result.record['error']):.1e}"


def _threads_text(count: int) -> str:
    return f"up to {count} threads" if count > 1 else "1 thread"


def _threads(data: Data) -> list[int]:
    return sorted(int(name.removeprefix("threads_")) for name in data.get("meetings", {}))


def _problems(data: Data) -> Iterator[str]:
    return (name for name in PROBLEMS if name in data)


def _measured(group: Data) -> list[str]:
    return [name for name in METHODS if name in group]


def _plain(value: Any) -> Any:
    """Value as JSON can hold it; None for what is not finite."""
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, list) or np.ndim(value):
        return [_plain(each) for each in value]
    return value if isinstance(value, (str, bool)) else _finite(value)


def _finite(x: Scalar) -> float | None:
    return float(x) if math.isfinite(x) else None
