"""Problems and methods as data: what is tried for each method, and where methods meet.

Nothing is imported that computes: tables and figures read this too.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.data import Data

Setting = dict[str, Any]
"""Words to a method's module."""


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
    error: str
    """Meaning of its error."""
    kind: str
    """``motion``, ``long`` (a motion of very many periods), ``routes`` or ``angle``."""
    default: str
    """The method that rigidpend picks for it."""
    level: float | None = None
    """The error at which methods meet; at the codes every symbol is right."""


_DISTANCE = "largest distance of (M/|M|, gamma) from the truth at the end, over the orbits"
PROBLEMS = {
    "free_body": Contest("free body", _DISTANCE, "motion", "aligned_batch", 1e-9),
    "pendulum": Contest("pendulum (5:3)", _DISTANCE, "motion", "closed_form", 1e-9),
    # Like is compared with like: other methods deliver symbols and no word on whether they are
    # right. `route_codes`, which vouches for each, is a line of its own.
    "codes": Contest(
        "route codes of Fig. 4",
        "median over the columns of the largest error of a crossing time, t'",
        "routes",
        "aligned_batch",
    ),
    "precession_angle": Contest(
        "alpha(T) of Fig. 5",
        "largest error of alpha(T), radians, over the two orbits",
        "angle",
        "aligned_batch",
        1e-6,
    ),
    "long_time": Contest(
        "integrals over long times",
        "largest drift of energy, |gamma| and M.gamma, relative, over the orbits and the time",
        "long",
        "aligned_batch",
        1e-9,
    ),
}


class Method(NamedTuple):
    """A method and what it answers."""

    label: str
    family: str
    """Ours, or whose; `measure.made` has the module that answers for it."""
    answers: tuple[str, ...] = ("motion", "long", "routes", "angle")
    """Problems that it answers, or kinds of them."""
    told: Setting = {}  # noqa: RUF012
    """Words to its module beyond task, knob, threads and a setting."""
    knob: str = "tolerance"
    """``tolerance``, ``steps`` (in a period), or ``none``."""
    finest: float = 2.0**-52
    """The finest tolerance that it takes."""
    libraries: tuple[str, ...] = ()
    """Libraries beyond NumPy; imported, and timed, before anything else."""
    forms: tuple[Setting, ...] = ({},)
    """Settings that change the cost and not the error: tried at one knob, the fastest counts."""
    variants: tuple[Setting, ...] = ({},)
    """Settings that change the error too: each is tried at every knob."""
    threads: bool = True
    """True if a second thread can serve it: it leaves Python's lock while it computes."""
    runs: tuple[tuple[str, Entrant], ...] = ()
    """Methods that a cross-check compares; the third decides."""
    certain: bool = False
    """True if it says which of its symbols can be trusted."""

    def answer(self, problem: str) -> bool:
        """True if it answers a problem."""
        return problem in self.answers or PROBLEMS[problem].kind in self.answers

    def entry(
        self, knob: float | None, form: int = 0, variant: int = 0, part: float = 1
    ) -> Entrant:
        """A knob with the setting of a form and a variant."""
        return Entrant(knob, {**self.forms[form], **self.variants[variant]}, part)


def _variants(name: str, *values: Any) -> tuple[Setting, ...]:
    return tuple({name: value} for value in values)


def _certain(label: str, way: str, *answers: str) -> Method:
    said = f"{label}, every symbol certain"
    return Method(said, OURS, answers, {"way": way}, "none", certain=True)


OURS, HEYOKA, CYRK, DIFFRAX, SCIPY = "ours", "heyoka", "cyrk", "diffrax", "scipy"
"""Families of methods; our operator splitting, `lie_poisson`, is one of its own."""
OWN = (OURS, "lie_poisson")
"""Families that are in this package: they are no peers."""
LANES: Setting = {"libraries": ("heyoka",), "forms": _variants("lanes", 4, 8, 16)}
FINEST_SCIPY = 2.3e-14

METHODS = {
    "closed_form": Method(
        "closed form", OURS, ("free_body", "pendulum"), {"way": "closed"}, "none",
        libraries=("scipy.special",), threads=False,
    ),
    "route_codes": _certain("route_codes", "integration", "routes"),
    "route_codes_map": _certain("route_codes by return maps", "map"),
    "route_codes_auto": _certain("route_codes as it comes", "auto"),
    "aligned_batch": Method("aligned Taylor, batches", OURS),
    "aligned_106": Method("aligned Taylor, 106 bits", OURS, ("routes",), {"bits": 106}, "none"),
    "lie_poisson": Method(
        "Lie-Poisson operator splitting", "lie_poisson", ("motion", "long"), {"way": "splitting"},
        "steps", variants=_variants("order", 2, 4, 6, 8), threads=False,
    ),
    "heyoka_principal": Method("heyoka, Euler-Poisson, batches", HEYOKA, **LANES),
    "heyoka_eq1": Method(
        "heyoka, (eq1), batches", HEYOKA, ("motion", "long", "routes"), {"eq1": True}, **LANES
    ),
    "cyrk": Method(
        "CyRK, compiled by numba", CYRK, finest=FINEST_SCIPY, libraries=("CyRK", "numba"),
        variants=_variants("method", "DOP853", "Vern8", "LSODA"),
    ),
    # Tighter, steps are refused for ever.
    "diffrax": Method(
        "diffrax, jitted and vmapped", DIFFRAX, finest=2e-14, libraries=("jax", "diffrax"),
        variants=_variants("solver", "Dopri8", "Tsit5"),
    ),
    "scipy_dop853": Method(
        "SciPy DOP853", SCIPY, finest=FINEST_SCIPY, libraries=("scipy.integrate",), threads=False
    ),
}  # fmt: skip
"""Every method by its name; cross-checks of peers follow."""
PRINCIPAL, EQ1 = (
    (name, Entrant(2.0**-52, {"lanes": 8})) for name in ("heyoka_principal", "heyoka_eq1")
)
COARSER = "heyoka_principal", Entrant(1e-14, {"lanes": 8})
COMPARED = {
    "heyoka_two_forms": ("heyoka, both forms", (PRINCIPAL, EQ1, COARSER)),
    "heyoka_two_tolerances": ("heyoka, two tolerances", (PRINCIPAL, COARSER, EQ1)),
    "cyrk_two_methods": ("CyRK, two methods", tuple(
        ("cyrk", Entrant(knob, {"method": name}))
        for knob, name in ((1e-13, "DOP853"), (1e-13, "Vern8"), (3e-14, "DOP853"))
    )),
    "diffrax_two_tolerances": ("diffrax, two tolerances", tuple(
        ("diffrax", Entrant(knob, {"solver": name}))
        for knob, name in ((1e-13, "Dopri8"), (3e-14, "Dopri8"), (1e-12, "Dopri5"))
    )),
    "scipy_two_tolerances": ("SciPy DOP853, two tolerances", tuple(
        ("scipy_dop853", Entrant(knob)) for knob in (1e-12, 1e-13, 3e-14)
    )),
}  # fmt: skip
METHODS |= {
    name: Method(
        f"{label} compared", METHODS[runs[0][0]].family, ("routes",), knob="none", runs=runs,
        libraries=METHODS[runs[0][0]].libraries, threads=METHODS[runs[0][0]].threads, certain=True,
    )
    for name, (label, runs) in COMPARED.items()
}  # fmt: skip


def knobs(method: Method, search: Any, long: bool) -> list[float | None]:
    """Knobs that a method is tried with, loosest first."""
    if method.knob == "none":
        return [None]
    if method.knob == "steps":
        return list(search.long_steps if long else search.steps)
    tolerances = search.long_tolerances if long else search.tolerances
    return [float(x) for x in tolerances if float(x) >= method.finest]


def best(problem: str, name: str, record: Data, search: Any) -> Entrant:
    """The entry of a method that its search at a problem chose.

    Without a search, the finest knob with the middle form and the first variant.
    """
    method = METHODS[name]
    if "seconds" not in record:
        return method.entry(knobs(method, search, False)[-1], len(method.forms) // 2)
    k = chosen(problem, record)
    knob, part = (float(record[key][k]) for key in ("knob", "part"))
    form, variant = int(record["form"]), int(record["setting"][k])
    return method.entry(None if np.isnan(knob) else knob, form, variant, part)


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
        and group[name]["once"][chosen(problem, group[name])] <= slowest
    }
