"""Methods as data: what is tried for each, and which setting is chosen.

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


class Method(NamedTuple):
    """A method that tells symbols."""

    label: str
    family: str
    """``ours``, or whose; `peers.ADAPTERS` has the function that answers for it."""
    finest: float | None = 2.0**-52
    """The finest tolerance that it takes; None where there is none to choose."""
    libraries: tuple[str, ...] = ()
    """Libraries beyond NumPy, imported before anything is timed."""
    variants: tuple[Setting, ...] = ({},)
    """Settings: each is tried at every tolerance."""
    drawn: Setting = {}  # noqa: RUF012
    """Words that are other ones with bodies drawn by lot."""
    runs: tuple[tuple[str, Entrant], ...] = ()
    """Methods that a cross-check compares; the third decides."""
    certain: bool = False
    """True if it says which of its symbols can be trusted."""

    @property
    def peer(self) -> bool:
        """True for a method that is not in this package."""
        return self.family != "ours"


FINEST_SCIPY = 2.3e-14
# Like is compared with like: other methods deliver symbols and no word on whether they are right.
# `route_codes`, which vouches for each, is a line of its own.
DEFAULT = "aligned_batch"
"""The method to which the others are compared at Fig. 4."""
METHODS = {
    "route_codes": Method(
        "route_codes, every symbol certain", "ours", None, variants=({"way": "integration"},),
        # It may build return maps.
        drawn={"way": "auto"}, certain=True,
    ),
    "route_codes_often": Method(
        "route_codes called often, every symbol certain", "ours", None,
        variants=({"way": "auto", "calls": 20},), certain=True,
    ),
    DEFAULT: Method("aligned Taylor, batches", "ours"),
    "heyoka_principal": Method(
        "heyoka, Euler-Poisson, batches", "heyoka", libraries=("heyoka",),
        variants=({"lanes": 8}, {"lanes": 4}, {"lanes": 16}),
        # It is compiled once for all of them.
        drawn={"parameters": True},
    ),
    "cyrk": Method(
        "CyRK, compiled by numba", "cyrk", FINEST_SCIPY, ("CyRK", "numba"),
        variants=({"method": "DOP853"}, {"method": "Vern8"}),
    ),
    "scipy_dop853": Method("SciPy DOP853", "scipy", FINEST_SCIPY, ("scipy.integrate",)),
}  # fmt: skip
"""Every method by its name; cross-checks of peers follow."""
COMPARED = {
    "heyoka_two_tolerances": ("heyoka, two tolerances", tuple(
        ("heyoka_principal", Entrant(tolerance)) for tolerance in (2.0**-52, 1e-14, 1e-15)
    )),
    "cyrk_two_methods": ("CyRK, two methods", tuple(
        ("cyrk", Entrant(tolerance, {"method": name}))
        for tolerance, name in ((1e-13, "DOP853"), (1e-13, "Vern8"), (3e-14, "DOP853"))
    )),
}  # fmt: skip
METHODS |= {
    name: METHODS[runs[0][0]]._replace(
        label=f"{label} compared", finest=None, variants=({},), runs=runs, certain=True
    )
    for name, (label, runs) in COMPARED.items()
}


def tolerances(name: str, search: Any) -> list[float | None]:
    """Tolerances that a method is tried with, loosest first."""
    finest, asked = METHODS[name].finest, sorted(map(float, search.tolerances), reverse=True)
    return [None] if finest is None else [x for x in asked if x >= finest]


def finest(name: str, search: Any) -> Entrant:
    """The entry of a method at its finest tolerance, with its first variant."""
    return Entrant(tolerances(name, search)[-1], METHODS[name].variants[0])


def best(name: str, record: Data, search: Any) -> Entrant:
    """The entry of a method that its search chose; the finest one without a search."""
    if "seconds" not in record:
        return finest(name, search)
    k = chosen(record)
    tolerance = float(record["tolerance"][k])
    setting = METHODS[name].variants[int(record["setting"][k])]
    return Entrant(None if np.isnan(tolerance) else tolerance, setting)


def chosen(record: Data) -> int:
    """The row of the fastest setting that had every symbol right; else of the most exact one."""
    right = np.asarray(record["wrong_symbols"]) == 0
    if right.any():
        return int(np.argmin(np.where(right, record["seconds"], np.inf)))
    return int(np.argmin(np.nan_to_num(record["error"], nan=np.inf)))


def guests(records: Data, config: Any) -> dict[str, Entrant]:
    """The methods that meet, of which `records` has the search; who is too slow stays away."""
    slowest = float(config.search.slowest)
    return {
        name: best(name, records[name], config.search)
        for name in config.problem.methods
        if "seconds" in records.get(name, {})
        and records[name]["seconds"][chosen(records[name])] <= slowest
    }
