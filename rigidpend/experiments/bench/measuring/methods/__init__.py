"""The methods: ours and the others, each at its best; what is tried for each stands here.

A module has functions ``f(task, knob, threads, **setting)`` that make ready and give a
`tasks.Carrier` or a `tasks.Solver`; the knob is a tolerance or the number of steps in a period.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any, NamedTuple

Setting = dict[str, Any]


class Answer(NamedTuple):
    """A function of a method's module, with what it is told beyond task, knob and threads."""

    module: str
    function: str
    told: Setting = {}  # noqa: RUF012


class Method(NamedTuple):
    """A method and what it answers."""

    label: str
    family: str
    """Ours, or whose."""
    answers: dict[str, Answer]
    """Answers by problem, or by its kind."""
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
    abreast: bool = True
    """True if the method carries orbits side by side; else only a few are measured."""
    threads: bool = True
    """True if a second thread can serve it: it leaves Python's lock while it computes."""
    cross_checked: bool = False
    """True if the method says which of its symbols can be trusted."""

    def answer(self, problem: str, kind: str) -> Answer | None:
        """Give how it answers a problem, if it does."""
        return self.answers.get(problem) or self.answers.get(kind)

    def absent(self) -> str:
        """Name the first of its libraries that is not installed; empty where all are."""
        missing = [name for name in self.libraries if importlib.util.find_spec(name) is None]
        return missing[0] if missing else ""


def _answers(
    module: str, prefix: str = "", kinds: str = "motion long routes angle", **told: Any
) -> Any:
    """The answers of a module whose functions are called motion, codes and angle."""
    functions = {"motion": "motion", "long": "motion", "routes": "codes", "angle": "angle"}
    return {kind: Answer(module, prefix + functions[kind], told) for kind in kinds.split()}


def _cross_check(label: str, function: str, libraries: tuple[str, ...]) -> Method:
    family = function.partition("_")[0]
    return Method(
        label,
        family,
        {"routes": Answer("cross_checks", function)},
        knob="none",
        libraries=libraries,
        threads=family != "scipy",
        cross_checked=True,
    )


HEYOKA, SCIPY, JAX = ("heyoka",), ("scipy.integrate",), ("jax", "diffrax")
BUILDS = tuple(
    {"lanes": lanes, "compact": compact} for lanes in (1, 4, 8, 16) for compact in (False, True)
)
"""Builds of heyoka: lanes, and whether its code is compact."""

METHODS = {
    "closed_form": Method(
        "closed form",
        "ours",
        {
            "free_body": Answer("closed_form", "free_body"),
            "pendulum": Answer("closed_form", "pendulum"),
        },
        knob="none",
        libraries=("scipy.special",),
        threads=False,
    ),
    "route_codes": Method(
        "route_codes, every symbol certain",
        "ours",
        {
            "routes": Answer("aligned_taylor", "route_codes"),
            "many": Answer("aligned_taylor", "route_codes", {"method": "integration"}),
        },
        knob="none",
        libraries=HEYOKA,
        cross_checked=True,
    ),
    "route_codes_map": Method(
        "route_codes by return maps, every symbol certain",
        "ours",
        {"many": Answer("aligned_taylor", "route_codes", {"method": "map"})},
        knob="none",
        libraries=HEYOKA,
        cross_checked=True,
    ),
    "aligned_batch": Method(
        "aligned Taylor, batches",
        "ours",
        {
            **_answers("aligned_taylor", kinds="motion long angle"),
            "routes": Answer("aligned_taylor", "crossings"),
        },
        libraries=HEYOKA,
    ),
    **{
        f"aligned_{bits}": Method(
            f"aligned Taylor, {bits} bits",
            "ours",
            {"routes": Answer("aligned_taylor", "crossings", {"bits": bits})},
            knob="none",
            libraries=HEYOKA,
            abreast=bits == 106,
        )
        for bits in (64, 106, 113)
    },
    "lie_poisson": Method(
        "Lie-Poisson operator splitting",
        "lie_poisson",
        _answers("operator_splitting"),
        knob="steps",
        variants=tuple({"order": order} for order in (2, 4, 6, 8)),
        threads=False,
    ),
    "heyoka_principal": Method(
        "heyoka, Euler-Poisson, batches",
        "heyoka",
        _answers("plain_heyoka", "principal_"),
        libraries=HEYOKA,
        forms=BUILDS,
    ),
    "heyoka_eq1": Method(
        "heyoka, (eq1), batches",
        "heyoka",
        _answers("plain_heyoka", "eq1_", "motion long routes"),
        libraries=HEYOKA,
        forms=BUILDS,
    ),
    "heyoka_ensemble": Method(
        "heyoka, Euler-Poisson, ensemble",
        "heyoka",
        {"motion": Answer("plain_heyoka", "ensemble_motion")},
        libraries=HEYOKA,
        forms=({"lanes": 4}, {"lanes": 8}, {"lanes": 16}),
    ),
    "cyrk": Method(
        "CyRK, compiled by numba",
        "cyrk",
        _answers("cyrk_compiled"),
        finest=2.3e-14,
        libraries=("CyRK", "numba"),
        variants=tuple({"method": name} for name in ("DOP853", "Vern8", "LSODA")),
    ),
    "diffrax": Method(
        "diffrax, jitted and vmapped",
        "diffrax",
        _answers("diffrax_vmapped"),
        # Tighter, steps are refused for ever.
        finest=2e-14,
        libraries=JAX,
        variants=({"solver": "Dopri8"}, {"solver": "Tsit5"}),
    ),
    "rebound": Method(
        "REBOUND, Bulirsch-Stoer",
        "rebound",
        _answers("rebound_ode"),
        finest=1e-15,
        libraries=("rebound", "numba"),
        abreast=False,
    ),
    "cvode": Method(
        "SUNDIALS CVODE",
        "sundials",
        _answers("sundials_cvode"),
        finest=1e-14,
        libraries=("sksundae", "numba"),
        variants=({"method": "Adams"}, {"method": "BDF"}),
        abreast=False,
        threads=False,
    ),
    "scipy_dop853": Method(
        "SciPy DOP853",
        "scipy",
        _answers("scipy_ivp", method="DOP853"),
        finest=2.3e-14,
        libraries=SCIPY,
        forms=({"abreast": True}, {"abreast": False}),
        threads=False,
    ),
    **{
        f"scipy_{method.lower()}": Method(
            f"SciPy {method}",
            "scipy",
            _answers("scipy_ivp", method=method),
            finest=2.3e-14,
            libraries=SCIPY,
            abreast=False,
            threads=False,
        )
        for method in ("LSODA", "Radau")
    },
    **{
        function: _cross_check(label, function, libraries)
        for function, label, libraries in (
            ("heyoka_two_forms", "heyoka, both forms compared", HEYOKA),
            ("heyoka_two_tolerances", "heyoka, two tolerances compared", HEYOKA),
            ("cyrk_two_methods", "CyRK, two methods compared", ("CyRK", "numba")),
            ("diffrax_two_tolerances", "diffrax, two tolerances compared", JAX),
            ("scipy_two_tolerances", "SciPy DOP853, two tolerances compared", SCIPY),
        )
    },
}


def spelt(setting: Setting) -> str:
    """A setting in words."""
    return ", ".join(f"{name} {value}" for name, value in setting.items())


def function(answer: Answer, threads: int, setting: Setting) -> Callable[[Any, Any], Any]:
    """Give the function of an answer: of a task and a knob. Imports what it needs."""
    module = _module(answer.module)

    def make(task: Any, knob: Any) -> Any:
        return getattr(module, answer.function)(task, knob, threads, **answer.told, **setting)

    return make


def _module(name: str) -> Any:
    """A module of methods; each is imported alone, for it may need what is not installed."""
    # Spelt out, so that the hash of the code that computes finds them.
    match name:
        case "aligned_taylor":
            from rigidpend.experiments.bench.measuring.methods import aligned_taylor

            return aligned_taylor
        case "cross_checks":
            from rigidpend.experiments.bench.measuring.methods import cross_checks

            return cross_checks
        case "closed_form":
            from rigidpend.experiments.bench.measuring.methods import closed_form

            return closed_form
        case "cyrk_compiled":
            from rigidpend.experiments.bench.measuring.methods import cyrk_compiled

            return cyrk_compiled
        case "diffrax_vmapped":
            from rigidpend.experiments.bench.measuring.methods import diffrax_vmapped

            return diffrax_vmapped
        case "operator_splitting":
            from rigidpend.experiments.bench.measuring.methods import operator_splitting

            return operator_splitting
        case "plain_heyoka":
            from rigidpend.experiments.bench.measuring.methods import plain_heyoka

            return plain_heyoka
        case "rebound_ode":
            from rigidpend.experiments.bench.measuring.methods import rebound_ode

            return rebound_ode
        case "scipy_ivp":
            from rigidpend.experiments.bench.measuring.methods import scipy_ivp

            return scipy_ivp
        case "sundials_cvode":
            from rigidpend.experiments.bench.measuring.methods import sundials_cvode

            return sundials_cvode
    raise KeyError(name)
