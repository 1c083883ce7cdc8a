"""A result of the benchmark as `store.load` gives it, made up."""

from __future__ import annotations

from typing import Any

import numpy as np


def record(error: Any, seconds: Any, **more: Any) -> dict[str, Any]:
    """The record of a method."""
    n = len(error)
    return {
        "ended": "complete",
        "knob": np.logspace(-2, -1 - n, n),
        "error": np.array(error),
        "seconds": np.array(seconds),
        # Half and twice the median, to be told from it.
        "fastest": np.array(seconds) / 2,
        "slowest": np.array(seconds) * 2,
        "repeats": np.full(n, 5.0),
        "memory": np.full(n, 50.0),
        **{name: np.array(values) for name, values in more.items()},
    }


def data() -> dict[str, Any]:
    """Three problems, five methods, and the cost of codes."""
    texts = {"error": "largest error"}
    return {
        "free_body": {
            **texts,
            "title": "free body",
            "default": "aligned_batch",
            "aligned_batch": record([1e-4, 1e-8, 1e-13], [1e-3, 2e-3, 4e-3]),
            "scipy_dop853": record([1e-2, 1e-6, 5e-10], [0.1, 0.2, 0.4]),
            "heyoka_eq1": record([1e-2, 1e-8, np.nan], [5e-4, 3e-3, 4e-3]),
            "diffrax": {"ended": "absent: jax is not installed"},
        },
        "codes": {
            **texts,
            "title": "route codes",
            "default": "aligned_batch",
            "route_codes": record([1e-9], [0.02], wrong_symbols=[0.0]),
            "aligned_batch": record([1e-2, 1e-7], [0.006, 0.007], wrong_symbols=[3.0, 0.0]),
            "scipy_dop853": record(
                [5.0, 1e-3, 1e-6], [4.0, 12.0, 16.0], wrong_symbols=[99.0, 1.0, 0.0]
            ),
        },
        "long_time": {
            **texts,
            "title": "integrals over long times",
            "default": "aligned_batch",
            "aligned_batch": record([1e-6, 1e-11], [1.0, 2.0], reach=[1e5, 1e5], asked=[1e5, 1e5]),
            "scipy_dop853": record([1e-13], [0.5], reach=[300.0], asked=[1e5]),
        },
        "scaling": {
            "orbits": {
                "route_codes": {
                    "ended": "complete",
                    "columns": np.array([1.0, 10.0]),
                    "seconds": np.array([2e-3, 5e-3]),
                }
            },
            "symbols": {
                "route_codes": {
                    "ended": "complete",
                    "n_symbols": np.array([1.0, 5.0]),
                    "seconds": np.array([2e-3, 8e-3]),
                }
            },
        },
    }
