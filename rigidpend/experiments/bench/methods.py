"""Problems and methods as data: what is tried for each method, and where methods meet.

Nothing is imported that computes: tables and figures read this too.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.data import Data

Setting = dict[str, Any]
"""Words to the adapter of a method."""


class Entrant(NamedTuple):
    """A method as it takes part: its knob and its setting."""

    knob: float | None = None
    """Tolerance, or steps in a period; None where there is none."""
    setting: Setting = {}  # noqa: RUF012
    part: float = 1.0
    """The part of the way that it goes, over long times."""

    def __str__(self) -> str:
        knob = [] if self.knob is None else [f"knob {self.knob:g}"]
        return ", ".join([*knob, *(f"{name} {value}" for name, value in self.setting.items())])


class Contest(NamedTuple):
    """A problem of the benchmark; `problems.ASKED` has its task, its truth and its error."""

    title: str
    default: str = "aligned_batch"
    """The method that rigidpend picks for it."""
    level: float | None = None
    """The error at which methods meet; at the codes every symbol is right."""


PROBLEMS = {
    "free_body": Contest("free body", level=1e-9),
    "pendulum": Contest("pendulum (5:3)", "closed_form", 1e-9),
    # Like is compared with like: other methods deliver symbols and no word on whether they are
    # right. `route_codes`, which vouches for each, is a line of its own.
    "codes": Contest("route codes of Fig. 4"),
    "precession_angle": Contest("alpha(T) of Fig. 5", level=1e-6),
    "long_time": Contest("integrals over long times", level=1e-9),
}
LONG = "long_time"
"""The problem of so many periods that a slow method goes a part of the way."""


class Method(NamedTuple):
    """A method and what it answers."""

    label: str
    family: str
    """Ours, or whose; `peers.ADAPTERS` has the function that answers for it."""
    answers: tuple[str, ...] = tuple(PROBLEMS)
    """Problems that it answers."""
    knob: str = "tolerance"
    """``tolerance``, ``steps`` (in a period), or ``none``."""
    finest: float = 2.0**-52
    """The finest tolerance that it takes."""
    libraries: tuple[str, ...] = ()
    """Libraries beyond NumPy, imported before anything is timed."""
    variants: tuple[Setting, ...] = ({},)
    """Settings: each is tried at every knob."""
    threads: bool = True
    """True if a second thread can serve it: it leaves Python's lock while it computes."""
    runs: tuple[tuple[str, Entrant], ...] = ()
    """Methods that a cross-check compares; the third decides."""
    certain: bool = False
    """True if it says which of its symbols can be trusted."""

    @property
    def peer(self) -> bool:
        """True for a method that is not in this package."""
        return self.family not in ("ours", "lie_poisson")


def _variants(name: str, *values: Any) -> tuple[Setting, ...]:
    return tuple({name: value} for value in values)


def _certain(label: str, way: str, *answers: str) -> Method:
    return Method(
        f"{label}, every symbol certain", "ours", answers, "none",
        variants=_variants("way", way), certain=True,
    )  # fmt: skip


LANES = _variants("lanes", 8, 4, 16)
MOTIONS = ("free_body", "pendulum", LONG)
FINEST_SCIPY = 2.3e-14

METHODS = {
    "closed_form": Method(
        "closed form", "ours", ("free_body", "pendulum"), "none",
        libraries=("scipy.special",), variants=_variants("way", "closed"), threads=False,
    ),
    "route_codes": _certain("route_codes", "integration", "codes"),
    "route_codes_map": _certain("route_codes by return maps", "map"),
    "route_codes_auto": _certain("route_codes as it comes", "auto"),
    "aligned_batch": Method("aligned Taylor, batches", "ours"),
    "aligned_106": Method(
        "aligned Taylor, 106 bits", "ours", ("codes",), "none", variants=_variants("bits", 106)
    ),
    "lie_poisson": Method(
        "Lie-Poisson operator splitting", "lie_poisson", MOTIONS, "steps",
        variants=_variants("order", 2, 4, 6, 8), threads=False,
    ),
    "heyoka_principal": Method(
        "heyoka, Euler-Poisson, batches", "heyoka", libraries=("heyoka",), variants=LANES
    ),
    "heyoka_eq1": Method(
        "heyoka, (eq1), batches", "heyoka", (*MOTIONS, "codes"), libraries=("heyoka",),
        variants=tuple({"eq1": True, **lanes} for lanes in LANES),
    ),
    "cyrk": Method(
        "CyRK, compiled by numba", "cyrk", finest=FINEST_SCIPY, libraries=("CyRK", "numba"),
        variants=_variants("method", "DOP853", "Vern8", "LSODA"),
    ),
    # Tighter, steps are refused for ever.
    "diffrax": Method(
        "diffrax, jitted and vmapped", "diffrax", finest=2e-14, libraries=("jax", "diffrax"),
        variants=_variants("solver", "Dopri8", "Tsit5"),
    ),
    "scipy_dop853": Method(
        "SciPy DOP853", "scipy", finest=FINEST_SCIPY, libraries=("scipy.integrate",), threads=False
    ),
}  # fmt: skip
"""Every method by its name; cross-checks of peers follow."""
FINE, COARSER = (("heyoka_principal", Entrant(knob)) for knob in (2.0**-52, 1e-14))
EQ1 = "heyoka_eq1", Entrant(2.0**-52, {"eq1": True})
COMPARED = {
    "heyoka_two_forms": ("heyoka, both forms", (FINE, EQ1, COARSER)),
    "heyoka_two_tolerances": ("heyoka, two tolerances", (FINE, COARSER, EQ1)),
    "cyrk_two_methods": ("CyRK, two methods", tuple(
        ("cyrk", Entrant(knob, {"method": name}))
        for knob, name in ((1e-13, "DOP853"), (1e-13, "Vern8"), (3e-14, "DOP853"))
    )),
}  # fmt: skip
METHODS |= {
    name: METHODS[runs[0][0]]._replace(
        label=f"{label} compared", answers=("codes",), knob="none", variants=({},),
        runs=runs, certain=True,
    )
    for name, (label, runs) in COMPARED.items()
}  # fmt: skip


def knobs(name: str, search: Any, long: bool) -> list[float | None]:
    """Knobs that a method is tried with, loosest first; others over long times."""
    method = METHODS[name]
    if method.knob == "none":
        return [None]
    if method.knob == "steps":
        return list(search.long_steps if long else search.steps)
    tolerances = search.long_tolerances if long else search.tolerances
    return [float(x) for x in tolerances if float(x) >= method.finest]


def best(problem: str, name: str, record: Data, search: Any) -> Entrant:
    """The entry of a method that its search at a problem chose.

    Without a search, the finest knob with the first variant.
    """
    variants = METHODS[name].variants
    if "seconds" not in record:
        return Entrant(knobs(name, search, problem == LONG)[-1], variants[0])
    k = chosen(problem, record)
    knob, number, part = (float(record[key][k]) for key in ("knob", "setting", "part"))
    return Entrant(None if np.isnan(knob) else knob, variants[int(number)], part)


def chosen(problem: str, record: Data) -> int:
    """The row of the fastest setting that is good enough; else of the most exact one."""
    enough = good_enough(problem, record)
    if enough.any():
        return int(np.argmin(np.where(enough, record["seconds"], np.inf)))
    return int(np.argmin(np.nan_to_num(record["error"], nan=np.inf)))


def good_enough(problem: str, record: Data) -> Any:
    """Mask of the rows that reach the level of a problem: a small error, or every symbol right."""
    level = PROBLEMS[problem].level
    if level is None:
        return np.asarray(record["wrong_symbols"]) == 0
    error = np.nan_to_num(record["error"], nan=np.inf)
    return (error <= level) & (np.asarray(record["part"]) == 1)


def guests(problem: str, group: Data, config: Any) -> dict[str, Entrant]:
    """The methods that meet at a problem, of which `group` has the records of the search.

    Each comes with the fastest of its settings that reached the level of the problem, or with
    its most exact one where none did. Who is too slow stays away.
    """
    slowest = float(config.meeting.slowest)
    return {
        name: best(problem, name, group[name], config.search)
        for name in config.problem.methods
        if "seconds" in group.get(name, {})
        and (group[name]["seconds"] * group[name]["part"])[chosen(problem, group[name])] <= slowest
    }
