"""Engine `taylor`, orbits at given times: one of any field, or batches of the aligned field."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.integrate.compiled import aligned_system, borrowed, heyoka


def sample(field: Any, state: Any, times: Any, tolerance: float) -> Any:
    """An orbit of any field at given times (see `rigidpend.integrate.sample`)."""
    hy = heyoka()
    names = [hy.make_vars(f"x{i}") for i in range(len(state))]
    system = list(zip(names, field(names, _Functions()), strict=True))
    integrator = hy.taylor_adaptive(system, state, time=times[0], tol=tolerance)
    ending, *_, states = integrator.propagate_grid(times)
    if int(ending) != int(hy.taylor_outcome.time_limit):
        raise ArithmeticError(f"the integration ended early: {ending}")
    return states.T


def sample_batch(coefficients: Any, states: Any, times: Any, tolerance: float) -> Any:
    """Orbits of the aligned field (see `rigidpend.integrate.sample_orbits`)."""
    n = states.shape[1]
    found = np.empty((6, times.size, n))
    with borrowed(_Sampler, tolerance) as sampler:
        for first in range(0, n, sampler.width):
            columns = slice(first, min(first + sampler.width, n))
            found[..., columns] = sampler.run(coefficients, states[:, columns], times)
    return found


class _Sampler:
    """A batch integrator without events."""

    def __init__(self, tolerance: float) -> None:
        hy = heyoka()
        self.width = hy.recommended_simd_size()
        field, _ = aligned_system(hy)
        self.integrator = hy.taylor_adaptive_batch(
            field,
            np.zeros((6, self.width)),
            pars=np.zeros((9, self.width)),
            tol=tolerance,
        )

    def run(self, coefficients: Any, states: Any, times: Any) -> Any:
        """At most `width` orbits; lanes without an orbit repeat the first."""
        n = states.shape[1]
        lanes = np.concatenate((states, np.repeat(states[:, :1], self.width - n, axis=1)), axis=1)
        self.integrator.pars[:] = np.asarray(coefficients)[:, None]
        self.integrator.set_time(times[0])
        self.integrator.state[:] = lanes
        _, found = self.integrator.propagate_grid(np.repeat(times[:, None], self.width, axis=1))
        if not np.isfinite(found).all():
            raise ArithmeticError("an orbit did not reach the last of the times")
        return found.transpose(1, 0, 2)[..., :n]


class _Functions:
    """The namespace of a field: heyoka's functions of symbols, math's of plain numbers."""

    def __getattr__(self, name: str) -> Callable[[Any], Any]:
        hy = heyoka()
        of_symbol, of_number = getattr(hy, name), getattr(math, name)
        return lambda x: (of_symbol if isinstance(x, hy.expression) else of_number)(x)
