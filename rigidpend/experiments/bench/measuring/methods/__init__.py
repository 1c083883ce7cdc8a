"""The methods: ours and the others, each at its best; what is tried for each stands here.

A function of a method's module, ``f(task, knob, threads, **setting)``, makes ready and gives a
`tasks.Carrier` or a `tasks.Solver`; the knob is a tolerance or the number of steps in a period.
Where a module has no such function it has the two that `peers` needs to answer for it.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from rigidpend.experiments.bench.measuring.methods import peers
from rigidpend.experiments.bench.measuring.methods.cross_checks import compared

Setting = dict[str, Any]


class Answer(NamedTuple):
    """A function of a method's module, with what it is told beyond task, knob and threads."""

    module: str
    function: str
    told: Setting = {}  # noqa: RUF012


class MethodRun(NamedTuple):
    """A run of a cross-check: a method with a tolerance and a setting."""

    method: str
    tolerance: float
    setting: Setting = {}  # noqa: RUF012


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

    def answers_to(self, problem: str, kind: str) -> Answer:
        """Give how it answers a problem that it does answer."""
        return self.answers[problem if problem in self.answers else kind]

    def absent(self) -> str:
        """Name the first of its libraries that is not installed; empty where all are."""
        missing = [name for name in self.libraries if importlib.util.find_spec(name) is None]
        return missing[0] if missing else ""


def _answers(module: str, prefix: str = "", **told: Any) -> dict[str, Answer]:
    """The answers of a module to every kind of problem."""
    functions = {"motion": "motion", "long": "motion", "routes": "codes", "angle": "angle"}
    return {kind: Answer(module, prefix + name, told) for kind, name in functions.items()}


def _variants(name: str, *values: Any) -> tuple[Setting, ...]:
    return tuple({name: value} for value in values)


def _ours(label: str, routes: Answer | None = None, **more: Any) -> Method:
    answers = more.pop("answers", {}) | ({"routes": routes} if routes else {})
    return Method(label, "ours", answers, **{"libraries": HEYOKA, **more})


def _cross_check(label: str, *runs: MethodRun) -> Method:
    answers = {"routes": Answer("", "compared", {"runs": runs})}
    first = METHODS[runs[0].method]
    more: Setting = {"libraries": first.libraries, "threads": first.threads}
    return Method(f"{label} compared", first.family, answers, **CERTAIN, **more)


HEYOKA, SCIPY, JAX = ("heyoka",), ("scipy.integrate",), ("jax", "diffrax")
CERTAIN: Setting = {"knob": "none", "cross_checked": True}
ONE_BY_ONE: Setting = {"abreast": False, "threads": False}
BUILDS = tuple(
    {"lanes": lanes, "compact": compact} for lanes in (1, 4, 8, 16) for compact in (False, True)
)
"""Builds of heyoka: lanes, and whether its code is compact."""
FINEST_SCIPY = 2.3e-14

METHODS = {
    "closed_form": _ours(
        "closed form",
        answers={name: Answer("closed_form", name) for name in ("free_body", "pendulum")},
        knob="none",
        libraries=("scipy.special",),
        threads=False,
    ),
    "route_codes": _ours(
        "route_codes, every symbol certain",
        Answer("aligned_taylor", "route_codes"),
        answers={"many": Answer("aligned_taylor", "route_codes", {"method": "integration"})},
        **CERTAIN,
    ),
    "route_codes_map": _ours(
        "route_codes by return maps, every symbol certain",
        answers={"many": Answer("aligned_taylor", "route_codes", {"method": "map"})},
        **CERTAIN,
    ),
    "aligned_batch": _ours("aligned Taylor, batches", answers=_answers("aligned_taylor")),
    **{
        f"aligned_{bits}": _ours(
            f"aligned Taylor, {bits} bits",
            Answer("aligned_taylor", "codes", {"bits": bits}),
            knob="none",
            abreast=bits == 106,
        )
        for bits in (64, 106, 113)
    },
    "lie_poisson": Method(
        "Lie-Poisson operator splitting",
        "lie_poisson",
        _answers("operator_splitting"),
        knob="steps",
        variants=_variants("order", 2, 4, 6, 8),
        threads=False,
    ),
    "heyoka_principal": Method(
        "heyoka, Euler-Poisson, batches",
        "heyoka",
        _answers("plain_heyoka"),
        libraries=HEYOKA,
        forms=BUILDS,
    ),
    "heyoka_eq1": Method(
        "heyoka, (eq1), batches",
        "heyoka",
        {k: v for k, v in _answers("plain_heyoka", "eq1_").items() if k != "angle"},
        libraries=HEYOKA,
        forms=BUILDS,
    ),
    "heyoka_ensemble": Method(
        "heyoka, Euler-Poisson, ensemble",
        "heyoka",
        {"motion": Answer("plain_heyoka", "ensemble")},
        libraries=HEYOKA,
        forms=_variants("lanes", 4, 8, 16),
    ),
    "cyrk": Method(
        "CyRK, compiled by numba",
        "cyrk",
        _answers("cyrk_compiled"),
        finest=FINEST_SCIPY,
        libraries=("CyRK", "numba"),
        variants=_variants("method", "DOP853", "Vern8", "LSODA"),
    ),
    "diffrax": Method(
        "diffrax, jitted and vmapped",
        "diffrax",
        _answers("diffrax_vmapped"),
        # Tighter, steps are refused for ever.
        finest=2e-14,
        libraries=JAX,
        variants=_variants("solver", "Dopri8", "Tsit5"),
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
        variants=_variants("method", "Adams", "BDF"),
        **ONE_BY_ONE,
    ),
    "scipy_dop853": Method(
        "SciPy DOP853",
        "scipy",
        _answers("scipy_ivp", method="DOP853"),
        finest=FINEST_SCIPY,
        libraries=SCIPY,
        forms=_variants("abreast", True, False),
        threads=False,
    ),
    **{
        f"scipy_{name.lower()}": Method(
            f"SciPy {name}",
            "scipy",
            _answers("scipy_ivp", method=name),
            finest=FINEST_SCIPY,
            libraries=SCIPY,
            **ONE_BY_ONE,
        )
        for name in ("LSODA", "Radau")
    },
}
"""Every method by its name; cross-checks of peers follow."""

PRINCIPAL, EQ1 = MethodRun("heyoka_principal", 2.0**-52), MethodRun("heyoka_eq1", 2.0**-52)
COARSER = MethodRun("heyoka_principal", 1e-14)
METHODS |= {
    "heyoka_two_forms": _cross_check("heyoka, both forms", PRINCIPAL, EQ1, COARSER),
    "heyoka_two_tolerances": _cross_check("heyoka, two tolerances", PRINCIPAL, COARSER, EQ1),
    "cyrk_two_methods": _cross_check(
        "CyRK, two methods",
        *(
            MethodRun("cyrk", tolerance, {"method": name})
            for tolerance, name in ((1e-13, "DOP853"), (1e-13, "Vern8"), (3e-14, "DOP853"))
        ),
    ),
    "diffrax_two_tolerances": _cross_check(
        "diffrax, two tolerances",
        *(
            MethodRun("diffrax", tolerance, {"solver": name})
            for tolerance, name in ((1e-13, "Dopri8"), (3e-14, "Dopri8"), (1e-12, "Dopri5"))
        ),
    ),
    "scipy_two_tolerances": _cross_check(
        "SciPy DOP853, two tolerances",
        *(
            MethodRun("scipy_dop853", tolerance, {"abreast": abreast})
            for tolerance, abreast in ((1e-12, True), (1e-13, True), (1e-13, False))
        ),
    ),
}


def spelt(setting: Setting) -> str:
    """A setting in words."""
    return ", ".join(f"{name} {value}" for name, value in setting.items())


def function(answer: Answer, threads: int, setting: Setting) -> Callable[[Any, Any], Any]:
    """Give the function of an answer: of a task and a knob. Imports what it needs."""
    if runs := answer.told.get("runs"):
        makes = [_of_run(run, threads) for run in runs]
        return lambda task, _: compared(task, *makes)
    module = _module(answer.module)
    own = getattr(module, answer.function, None)
    make = own or partial(getattr(peers, answer.function), module)
    return lambda task, knob: make(task, knob, threads, **answer.told, **setting)


def _of_run(run: MethodRun, threads: int) -> Callable[[Any], Any]:
    make = function(METHODS[run.method].answers["routes"], threads, run.setting)
    return lambda task: make(task, run.tolerance)


def _module(name: str) -> Any:
    """A module of methods; each is imported alone, for it may need what is not installed."""
    found: Any
    # Spelt out, so that the hash of the code that computes finds them.
    match name:
        case "aligned_taylor":
            from rigidpend.experiments.bench.measuring.methods import aligned_taylor as found
        case "closed_form":
            from rigidpend.experiments.bench.measuring.methods import closed_form as found
        case "cyrk_compiled":
            from rigidpend.experiments.bench.measuring.methods import cyrk_compiled as found
        case "diffrax_vmapped":
            from rigidpend.experiments.bench.measuring.methods import diffrax_vmapped as found
        case "operator_splitting":
            from rigidpend.experiments.bench.measuring.methods import operator_splitting as found
        case "plain_heyoka":
            from rigidpend.experiments.bench.measuring.methods import plain_heyoka as found
        case "rebound_ode":
            from rigidpend.experiments.bench.measuring.methods import rebound_ode as found
        case "scipy_ivp":
            from rigidpend.experiments.bench.measuring.methods import scipy_ivp as found
        case "sundials_cvode":
            from rigidpend.experiments.bench.measuring.methods import sundials_cvode as found
    return found
