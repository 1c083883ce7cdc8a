"""A result of the benchmark as `store.load` gives it, made up."""

from __future__ import annotations

from typing import Any

import numpy as np


def record(error: Any, seconds: Any, **more: Any) -> dict[str, Any]:
    n = len(error)
    columns = {"setting": 0, "error": error, "seconds": seconds}
    columns |= {"tolerance": np.logspace(-2, -1 - n, n), **more}
    return {"ended": "complete", **{name: np.zeros(n) + x for name, x in columns.items()}}


def guest(rounds: Any, error: float = 1e-10, **more: Any) -> dict[str, Any]:
    numbers = {name: np.float64(value) for name, value in {"error": error, **more}.items()}
    return {"rounds": np.array(rounds, dtype=float), "chosen": "tolerance 1e-09", **numbers}


def codes_guest(rounds: Any) -> dict[str, Any]:
    return guest(rounds, 1e-7, wrong_symbols=0.0)


def counted(wrong: float) -> dict[str, Any]:
    """The record of a method on random phases: 100 orbits."""
    told = {"orbits": 100, "symbols": 1500, "seconds": 0.02}
    return {**told, "wrong_trusted": wrong, "undecided": 0.0}


def with_bodies(first: Any, again: Any, orbits: float, **more: float) -> dict[str, Any]:
    """The record of a method with bodies drawn by lot."""
    told = {"first": first, "again": again, "orbits": orbits, "symbols": 1e5}
    told |= {"wrong_trusted": 0.0, "undecided": 0.0, **more}
    return {name: np.zeros(len(first)) + x for name, x in told.items()}


def bodies(**methods: Any) -> dict[str, Any]:
    n = len(next(iter(methods.values()))["first"])
    told = {"A1": 2, "A2": 1, "A3": 1.5, "r1": 0.6, "r2": 0.8, "h0": 1, "J1_0": 1e-8}
    columns = {name: np.full(n, float(x)) for name, x in told.items()}
    return {**columns, "mu": 1e-3 * np.arange(1.0, n + 1), "ended": "complete", **methods}


def data() -> dict[str, Any]:
    """Two problems, some methods, two meetings, random phases and bodies."""
    texts = {"default": "aligned_batch"}
    nan = np.nan
    return {
        "free_body": {
            **texts,
            "title": "free body",
            "aligned_batch": record([1e-4, 1e-8, 1e-13], [1e-3, 2e-3, 4e-3]),
            "scipy_dop853": record([1e-2, 1e-6, 5e-10], [0.1, 0.2, 0.4]),
            "heyoka_eq1": record([1e-2, 1e-8, np.nan], [5e-4, 3e-3, 4e-3]),
            "diffrax": {"ended": "absent: jax is not installed"},
        },
        "codes": {
            **texts,
            "title": "route codes",
            "route_codes": record([1e-9], [0.02], wrong_symbols=[0.0]),
            "aligned_batch": record([1e-2, 1e-7], [0.006, 0.007], wrong_symbols=[3.0, 0.0]),
            "heyoka_principal": record([1e-6, 1e-8], [0.004, 0.005], wrong_symbols=[0.0, 0.0]),
            "scipy_dop853": record(
                [5.0, 1e-3, 1e-6], [4.0, 12.0, 16.0], wrong_symbols=[99.0, 1.0, 0.0]
            ),
        },
        "meetings": {
            "threads_1": {
                "free_body": {
                    "ended": "complete",
                    "aligned_batch": guest([2e-3, 4e-3, 3e-3]),
                    "scipy_dop853": guest([0.4, 0.8, nan]),
                    "heyoka_eq1": guest([1e-3, 8e-3, 9e-4], 1e-3),
                },
                "codes": {
                    "ended": "complete",
                    "route_codes": codes_guest([0.020, 0.018, 0.022]),
                    "aligned_batch": codes_guest([0.010, 0.008, 0.012]),
                    "heyoka_principal": codes_guest([0.008, 0.007, 0.009]),
                    "heyoka_two_forms": codes_guest([0.025, 0.020, 0.030]),
                },
            },
            "threads_2": {
                "codes": {
                    "ended": "complete",
                    "aligned_batch": codes_guest([0.006, 0.005, 0.007]),
                    "heyoka_principal": codes_guest([0.012, 0.010, 0.014]),
                },
            },
        },
        "random_phases": {
            "J1_0_1e-10": {"route_codes": counted(0), "heyoka_principal": counted(3)},
        },
        "bodies": bodies(
            route_codes_auto=with_bodies([1.0, 2.0, 8.0, 1.5], [0.05, 0.1, 0.4, 0.05], 10_000),
            heyoka_principal=with_bodies([0.5] * 4, [0.2, 0.2, 0.02, 0.2], 1000, wrong_trusted=40),
        ),
    }
