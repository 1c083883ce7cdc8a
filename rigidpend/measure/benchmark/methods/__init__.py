"""The methods: ours and the others, each a few lines that its users would write.

A module has functions ``f(task, knob, ...)`` that make ready and give a `tasks.Flow` or a
`tasks.Solver`; the knob is a tolerance or the number of steps in a period.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any, NamedTuple


class Answer(NamedTuple):
    """A function of a method's module, with what it is told beyond task and knob."""

    module: str
    function: str
    told: dict[str, Any] = {}  # noqa: RUF012


class Method(NamedTuple):
    """A method and what it answers."""

    label: str
    family: str
    """Ours, or whose."""
    answers: dict[str, Answer]
    """By problem, or by its kind."""
    knob: str = "tolerance"
    """``tolerance``, ``steps`` (in a period), or ``none``."""
    finest: float = 2.0**-52
    """The finest tolerance that it takes."""
    libraries: tuple[str, ...] = ()
    """What it needs beyond NumPy; imported, and timed, before anything else."""

    def answer(self, problem: str, kind: str) -> Answer | None:
        """How it answers a problem, if it does."""
        return self.answers.get(problem) or self.answers.get(kind)

    def absent(self) -> str:
        """The first of its libraries that is not installed; empty where all are."""
        missing = [name for name in self.libraries if importlib.util.find_spec(name) is None]
        return missing[0] if missing else ""


def _flow_like(module: str, *kinds: str, **told: Any) -> dict[str, Answer]:
    """The answers of a module whose functions are called flow, codes and angle."""
    functions = {"motion": "flow", "long": "flow", "routes": "codes", "angle": "angle"}
    return {kind: Answer(module, functions[kind], told) for kind in kinds or functions}


def _ours(**answers: Answer) -> dict[str, Answer]:
    """Ours; long times are a motion."""
    return {**answers, **({"long": answers["motion"]} if "motion" in answers else {})}


HEYOKA, SCIPY, JAX = ("heyoka",), ("scipy.integrate",), ("jax", "diffrax")
T = "aligned_taylor"

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
    ),
    "route_codes": Method(
        "route_codes (certain)",
        "ours",
        {"routes": Answer(T, "route_codes")},
        knob="none",
        libraries=HEYOKA,
    ),
    "aligned_batch": Method(
        "aligned Taylor, batch",
        "ours",
        _ours(
            motion=Answer(T, "batch"), routes=Answer(T, "crossings"), angle=Answer(T, "angle_batch")
        ),
        libraries=HEYOKA,
    ),
    "aligned_scalar": Method(
        "aligned Taylor, scalar",
        "ours",
        _ours(
            motion=Answer(T, "scalar"),
            routes=Answer(T, "crossings_scalar"),
            angle=Answer(T, "angle"),
        ),
        libraries=HEYOKA,
    ),
    "aligned_64": Method(
        "aligned Taylor, 64 bits",
        "ours",
        {
            "motion": Answer(T, "scalar", {"bits": 64}),
            "routes": Answer(T, "crossings", {"bits": 64}),
        },
        knob="none",
        libraries=HEYOKA,
    ),
    "aligned_113": Method(
        "aligned Taylor, 113 bits",
        "ours",
        {
            "motion": Answer(T, "scalar", {"bits": 113}),
            "routes": Answer(T, "crossings", {"bits": 113}),
        },
        knob="none",
        libraries=HEYOKA,
    ),
    **{
        f"splitting_{order}": Method(
            f"Lie-Poisson splitting, order {order}",
            "splitting",
            _flow_like("splitting", order=order),
            knob="steps",
        )
        for order in (2, 4, 6, 8)
    },
    "heyoka_eq1": Method(
        "heyoka, plain, (eq1)",
        "heyoka",
        {
            "motion": Answer("plain_heyoka", "eq1_flow"),
            "long": Answer("plain_heyoka", "eq1_flow"),
            "routes": Answer("plain_heyoka", "eq1_codes"),
        },
        libraries=HEYOKA,
    ),
    "heyoka_principal": Method(
        "heyoka, plain, Euler-Poisson",
        "heyoka",
        {
            "motion": Answer("plain_heyoka", "principal_flow"),
            "long": Answer("plain_heyoka", "principal_flow"),
            "routes": Answer("plain_heyoka", "principal_codes"),
            "angle": Answer("plain_heyoka", "principal_angle"),
        },
        libraries=HEYOKA,
    ),
    **{
        f"scipy_{method.lower()}": Method(
            f"SciPy {method}",
            "scipy",
            _flow_like("scipy_ivp", method=method),
            finest=2.3e-14,
            libraries=SCIPY,
        )
        for method in ("RK45", "DOP853", "Radau", "LSODA")
    },
    "diffrax": Method(
        "diffrax Dopri8, vmapped",
        "diffrax",
        _flow_like("diffrax_vmapped"),
        # Tighter, steps are refused for ever.
        finest=2e-14,
        libraries=JAX,
    ),
}


def function(answer: Answer) -> Callable[[Any, Any], Any]:
    """The function of an answer: of a task and a knob. Imports what it needs."""
    module = _MODULES[answer.module]()

    def make(task: Any, knob: Any) -> Any:
        return getattr(module, answer.function)(task, knob, **answer.told)

    return make


def _aligned_taylor() -> Any:
    from rigidpend.measure.benchmark.methods import aligned_taylor

    return aligned_taylor


def _closed_form() -> Any:
    from rigidpend.measure.benchmark.methods import closed_form

    return closed_form


def _plain_heyoka() -> Any:
    from rigidpend.measure.benchmark.methods import plain_heyoka

    return plain_heyoka


def _scipy_ivp() -> Any:
    from rigidpend.measure.benchmark.methods import scipy_ivp

    return scipy_ivp


def _splitting() -> Any:
    from rigidpend.measure.benchmark.methods import splitting

    return splitting


def _diffrax_vmapped() -> Any:
    from rigidpend.measure.benchmark.methods import diffrax_vmapped

    return diffrax_vmapped


# Spelt out, so that the hash of the code that computes finds them.
_MODULES: dict[str, Callable[[], Any]] = {
    "aligned_taylor": _aligned_taylor,
    "closed_form": _closed_form,
    "plain_heyoka": _plain_heyoka,
    "scipy_ivp": _scipy_ivp,
    "splitting": _splitting,
    "diffrax_vmapped": _diffrax_vmapped,
}
