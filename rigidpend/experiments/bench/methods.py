"""Problems and methods as data: what is tried for each method, and which setting is chosen.

Nothing is imported that computes: tables and figures read this too.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.data import Data

Setting = dict[str, Any]
"""Words to the adapter of a method."""


class Entrant(NamedTuple):
    """A method as it takes part: its tolerance and its setting."""

    tolerance: float | None = None
    """None where there is none to choose."""
    setting: Setting = {}  # noqa: RUF012

    def __str__(self) -> str:
        tolerance = [] if self.tolerance is None else [f"tolerance {self.tolerance:g}"]
        return ", ".join([*tolerance, *(f"{name} {x}" for name, x in self.setting.items())])


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
}


class Method(NamedTuple):
    """A method and what it answers."""

    label: str
    family: str
    """``ours``, or whose; `peers.ADAPTERS` has the function that answers for it."""
    answers: tuple[str, ...] = tuple(PROBLEMS)
    """Problems that it answers."""
    finest: float | None = 2.0**-52
    """The finest tolerance that it takes; None where there is none to choose."""
    libraries: tuple[str, ...] = ()
    """Libraries beyond NumPy, imported before anything is timed."""
    variants: tuple[Setting, ...] = ({},)
    """Settings: each is tried at every tolerance."""
    threads: bool = True
    """True if a second thread can serve it: it leaves Python's lock while it computes."""
    runs: tuple[tuple[str, Entrant], ...] = ()
    """Methods that a cross-check compares; the third decides."""
    certain: bool = False
    """True if it says which of its symbols can be trusted."""

    @property
    def peer(self) -> bool:
        """True for a method that is not in this package."""
        return self.family != "ours"


def _variants(name: str, *values: Any) -> tuple[Setting, ...]:
    return tuple({name: value} for value in values)


LANES = _variants("lanes", 8, 4, 16)
FINEST_SCIPY = 2.3e-14

METHODS = {
    "closed_form": Method(
        "closed form", "ours", ("pendulum",), None, variants=_variants("way", "closed"),
        threads=False,
    ),
    "route_codes": Method(
        "route_codes, every symbol certain", "ours", ("codes",), None,
        variants=_variants("way", "integration"), certain=True,
    ),
    # With bodies drawn by lot: it may build return maps.
    "route_codes_auto": Method(
        "route_codes as it comes, every symbol certain", "ours", (), None,
        variants=_variants("way", "auto"), certain=True,
    ),
    "aligned_batch": Method("aligned Taylor, batches", "ours"),
    "heyoka_principal": Method(
        "heyoka, Euler-Poisson, batches", "heyoka", libraries=("heyoka",), variants=LANES
    ),
    "heyoka_eq1": Method(
        "heyoka, (eq1), batches", "heyoka", ("free_body", "pendulum", "codes"),
        libraries=("heyoka",), variants=tuple({"eq1": True, **lanes} for lanes in LANES),
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
FINE, COARSER = (("heyoka_principal", Entrant(x)) for x in (2.0**-52, 1e-14))
EQ1 = "heyoka_eq1", Entrant(2.0**-52, {"eq1": True})
COMPARED = {
    "heyoka_two_forms": ("heyoka, both forms", (FINE, EQ1, COARSER)),
    "heyoka_two_tolerances": ("heyoka, two tolerances", (FINE, COARSER, EQ1)),
    "cyrk_two_methods": ("CyRK, two methods", tuple(
        ("cyrk", Entrant(tolerance, {"method": name}))
        for tolerance, name in ((1e-13, "DOP853"), (1e-13, "Vern8"), (3e-14, "DOP853"))
    )),
}  # fmt: skip
METHODS |= {
    name: METHODS[runs[0][0]]._replace(
        label=f"{label} compared", answers=("codes",), finest=None, variants=({},),
        runs=runs, certain=True,
    )
    for name, (label, runs) in COMPARED.items()
}  # fmt: skip


def tolerances(name: str, search: Any) -> list[float | None]:
    """Tolerances that a method is tried with, loosest first."""
    finest = METHODS[name].finest
    return [None] if finest is None else [x for x in map(float, search.tolerances) if x >= finest]


def best(problem: str, name: str, record: Data, search: Any) -> Entrant:
    """The entry of a method that its search at a problem chose.

    Without a search, the finest tolerance with the first variant.
    """
    variants = METHODS[name].variants
    if "seconds" not in record:
        return Entrant(tolerances(name, search)[-1], variants[0])
    k = chosen(problem, record)
    tolerance = float(record["tolerance"][k])
    setting = variants[int(record["setting"][k])]
    return Entrant(None if np.isnan(tolerance) else tolerance, setting)


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
    return np.nan_to_num(record["error"], nan=np.inf) <= level


def guests(problem: str, group: Data, config: Any) -> dict[str, Entrant]:
    """The methods that meet at a problem, of which `group` has the records of the search.

    Each comes with the fastest of its settings that reached the level of the problem, or with
    its most exact one where none did. Who is too slow stays away.
    """
    slowest = float(config.search.slowest)
    return {
        name: best(problem, name, group[name], config.search)
        for name in config.problem.methods
        if "seconds" in group.get(name, {})
        and group[name]["seconds"][chosen(problem, group[name])] <= slowest
    }
