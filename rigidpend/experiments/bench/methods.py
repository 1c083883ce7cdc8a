"""Methods as data: the settings tried for each, and the choice among them.

This module imports nothing that computes, because tables and figures read it too.
"""

from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.data import Data

Setting = dict[str, Any]
"""Keyword arguments for the adapter of a method."""


class Entrant(NamedTuple):
    """A method as it takes part: its tolerance and its setting."""

    tolerance: float | None = None
    """None if the method has no tolerance."""
    setting: Setting = {}  # noqa: RUF012


class Method(NamedTuple):
    """A method that finds symbols."""

    label: str
    family: str
    """``ours``, or the name of a library; `peers.PEERS` has its adapter."""
    finest: float | None = 2.0**-52
    """The finest tolerance that it accepts; None if it has no tolerance."""
    libraries: tuple[str, ...] = ()
    """Libraries beyond NumPy, without which it is absent."""
    variants: tuple[Setting, ...] = ({},)
    """Settings: each is tried at every tolerance."""
    drawn: Setting = {}  # noqa: RUF012
    """Arguments that replace those of `variants` for randomly drawn bodies."""
    runs: tuple[tuple[str, Entrant], ...] = ()
    """Methods that a cross-check compares; the third decides."""
    certain: bool = False
    """True if it marks the symbols that can be trusted."""

    @property
    def peer(self) -> bool:
        """True for a method that is not in this package."""
        return self.family != "ours"


FINEST_SCIPY = 2.3e-14
SMALLER = 1e-2
"""Absolute tolerance over the relative one, for components that pass through zero."""
# Like is compared with like: the default, as other methods, delivers symbols without certainty.
# `route_codes`, which establishes each symbol, is a line of its own.
DEFAULT = "aligned_batch"
"""The method to which the others are compared at Fig. 4."""
METHODS = {
    "route_codes": Method(
        "route_codes, every symbol certain", "ours", None, variants=({"way": "integration"},),
        # With randomly drawn bodies it may build return maps.
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
        # Compiled once for all randomly drawn bodies.
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
    """Tolerances at which a method is tried, loosest first."""
    finest, asked = METHODS[name].finest, sorted(map(float, search.tolerances), reverse=True)
    return [None] if finest is None else [x for x in asked if x >= finest]


def finest(name: str, search: Any) -> Entrant:
    """The entry of a method at its finest tolerance, with its first variant."""
    return Entrant(tolerances(name, search)[-1], METHODS[name].variants[0])


def best(name: str, record: Data, search: Any) -> Entrant:
    """The entry that a method's search chose; without a search that of the finest tolerance."""
    if "seconds" not in record:
        return finest(name, search)
    k = chosen(record)
    tolerance = float(record["tolerance"][k])
    setting = METHODS[name].variants[int(record["setting"][k])]
    return Entrant(None if np.isnan(tolerance) else tolerance, setting)


def chosen(record: Data) -> int:
    """The row of the fastest setting with every symbol right, or else of the most accurate one."""
    right = np.asarray(record["wrong_symbols"]) == 0
    if right.any():
        return int(np.argmin(np.where(right, record["seconds"], np.inf)))
    return int(np.argmin(np.nan_to_num(record["error"], nan=np.inf)))


def guests(records: Data, config: Any) -> dict[str, Entrant]:
    """The methods for the meeting, from their searches in `records`; slow ones are left out."""
    slowest = float(config.search.slowest)
    return {
        name: best(name, records[name], config.search)
        for name in config.problem.methods
        if "seconds" in records.get(name, {})
        and records[name]["seconds"][chosen(records[name])] <= slowest
    }
