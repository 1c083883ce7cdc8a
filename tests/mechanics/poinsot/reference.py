"""The free body by other means: textbook formulas in 60 digits, integration, random orbits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import cross, euler_poisson
from rigidpend.mechanics.poinsot.orbit import Orbit, encircling
from rigidpend.mechanics.poinsot.polhode import momentum
from rigidpend.orbits.integrate.states import states_at
from tests.strategies import FINE, bodies, numbers

EPS = float(np.finfo(float).eps)
NOWHERE = (0, 0, 0)


@st.composite
def bodies_and_orbits(draw: st.DrawFn, closest: float = -12) -> tuple[Body, Orbit]:
    """Orbits of all families, coheight or height down to 10^closest, with their bodies."""
    small = {draw(st.sampled_from(["height", "coheight"])): 10 ** draw(numbers(closest, -0.01))}
    axis, side = draw(st.sampled_from([1, 2])), draw(st.sampled_from([1, -1]))
    body = draw(bodies())
    return body, encircling(body, axis, side, G=draw(numbers(0.5, 3)), **small)


def orbits(closest: float = -12) -> st.SearchStrategy[Orbit]:
    """The orbits alone."""
    return bodies_and_orbits(closest).map(lambda pair: pair[1])


def textbook(body: Body, found: Orbit, coheight: Any, t: Any) -> list[Any]:
    """M in 60 digits from |M|, the energy and the moments, after Landau and Lifshitz, 37."""
    A = [x.in_context(FINE) for x in body.A]
    G, t, coheight = (FINE.mpf(x) for x in (found.G, t, coheight))
    first, middle, last = (1, 2, 0) if found.axis == 1 else (0, 2, 1)
    a, b, c = A[first], A[middle], A[last]
    # Where the orbit is highest, M_first = 0.
    twice = G**2 * ((1 - coheight**2) / b + coheight**2 / c)
    below, above = G**2 - a * twice, c * twice - G**2
    tau = t * FINE.sqrt((c - b) * below / (a * b * c))
    k2 = (b - a) * above / ((c - b) * below)
    M = [FINE.mpf(0)] * 3
    M[first] = FINE.sqrt(a * above / (c - a)) * FINE.ellipfun("cn", tau, m=k2)
    M[middle] = found.side * FINE.sqrt(b * above / (c - b)) * FINE.ellipfun("sn", tau, m=k2)
    M[last] = found.side * FINE.sqrt(c * below / (c - a)) * FINE.ellipfun("dn", tau, m=k2)
    return M


def aligned_components(orbit: Orbit, t: Any) -> Any:
    """Compute Qp, Qm and M3, dimensionless (`equations.aligned`), at times t: (3, ...).

    The small one of Qp and Qm comes from their product, which is constant: its relative error
    is that of the large one.
    """
    M1, M2, M3 = math.sqrt(orbit.shape.s2) * momentum(orbit, t)
    x, y = orbit.shape.cos * M1, orbit.shape.sin * M2
    product = -orbit.sigma * orbit.shape.s2 * (orbit.G * orbit.p * orbit.coheight) ** 2
    # The sum of two numbers of one sign is the larger of Qp and Qm, and has no cancellation.
    plus = x * y >= 0
    large = np.where(plus, x + y, x - y)
    Qp, Qm = np.where(plus, large, product / large), np.where(plus, product / large, large)
    return np.stack((Qp, Qm, M3))


def in_space(M: Any, A: Any, times: Any) -> tuple[Any, Any]:
    """M (3, n) integrated without weight, and omega in a fixed basis, (3, n).

    The basis: along M, along omega across M at the first of the times, and their product.
    """
    omega = M / np.asarray(A)
    axis = M / np.linalg.norm(M)
    radius = omega - axis * (axis @ omega)
    radius /= np.linalg.norm(radius)

    def rates(state: Any, _: Any) -> tuple[Any, ...]:
        omega = [state[i] / A[i] for i in range(3)]
        found = euler_poisson(state[:3], state[3:6], A, NOWHERE, 0.0)
        return (*found, *cross(state[6:], omega))

    found = states_at(rates, [*M, *radius, *np.cross(axis, radius)], times - times[0])
    M, *fixed = found.reshape(3, 3, -1)
    omega = M / np.asarray(A)[:, None]
    return M, np.array([(omega * v).sum(axis=0) for v in (M / np.linalg.norm(M, axis=0), *fixed)])


def rate(M: Any, A: Any) -> Any:
    """dM/dt without weight."""
    return euler_poisson(M, NOWHERE, A, NOWHERE, 0)[:3]
