"""Engines, bodies and orbits that the tests of the engines share."""

import importlib.util
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rigidpend import Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import aligned_coefficients
from rigidpend.orbits.integrate import Crossings, Orbits, crossings
from tests.bodies import FIG4 as FIG4
from tests.bodies import FREE as FREE
from tests.bodies import GENERIC as GENERIC


def needs_heyoka(why: str) -> pytest.MarkDecorator:
    """Mark of a test that is not for where heyoka is not installed: pip has it for Linux."""
    absent = importlib.util.find_spec("heyoka") is None
    return pytest.mark.skipif(absent, reason=f"heyoka is not installed: {why}")


ENGINES = ["taylor", "scipy"]
WAYS = [
    # What serves: vectors of doubles, of pairs of them, of fours; DOP853, integers.
    ("taylor", 53),
    ("taylor", 64),
    ("taylor", 106),
    ("taylor", 113),
    ("taylor", 212),
    ("scipy", 53),
    ("scipy", 113),
]


def theta1_on(separatrix: int, body: Body) -> float:
    """Where (sol_1), (sol_2), (sol_12), (sol_22) place the separatrices."""
    side = {1: -1, 2: 1, 3: -1, 4: 1}[separatrix]
    return body.beta0 + side * body.alpha0 + (2 * math.pi if separatrix > 2 else 0)


def on_separatrix(
    separatrix: int, body: Body, J1: float, theta2: float, J2: float = 1.0
) -> NDArray[np.float64]:
    """A state (6,) in aligned components, exactly on an unperturbed separatrix."""
    c = Canonical(J1, J2 - J1, 0.0, theta1_on(separatrix, body), theta2, 0.0, 1.0)
    state = aligned_from_canonical(c, body.alpha0, body.beta0)
    left_out = "Qm" if separatrix in (2, 4) else "Qp"
    return np.array(state._replace(**{left_out: 0.0}))


def fan(n: int, body: Body = FIG4, J1: float = 1e-4) -> NDArray[np.float64]:
    """States (6, n) on separatrix 2 with phases spread over the circle."""
    phases = np.linspace(0.1, 6.2, n)
    return np.stack([on_separatrix(2, body, J1, phase) for phase in phases], axis=1)


def task(
    states: NDArray[np.float64],
    bits: int = 53,
    *,
    body: Body = FIG4,
    n_crossings: int = 4,
    passage_limit: float = 200.0,
) -> Orbits:
    """Orbits that are the same, bit for bit, in every precision."""
    coefficients: Any = aligned_coefficients(body.angles(), math)
    if bits == 53:
        return Orbits(coefficients, states, n_crossings, passage_limit)
    exactly = np.vectorize(Fraction, otypes=[object])
    coefficients = type(coefficients)(*map(Fraction, coefficients))
    return Orbits(coefficients, exactly(states), n_crossings, passage_limit)


def find(
    states: NDArray[np.float64],
    engine: str,
    bits: int = 53,
    *,
    tolerance: float = 1e-13,
    jobs: int = 1,
    **of_task: Any,
) -> Crossings:
    """The crossings of such a task."""
    orbits = task(states, bits, **of_task)
    return crossings(orbits, engine=engine, bits=bits, tolerance=tolerance, jobs=jobs)


def by(engine: str, bits: int, jobs: int = 1) -> dict[str, Any]:
    """Named arguments of what follows orbits, with the finest tolerance."""
    return {"engine": engine, "bits": bits, "tolerance": 2.0**-52, "jobs": jobs}


def same(a: tuple[Any, ...], b: tuple[Any, ...]) -> bool:
    """Whether two records are equal, bit for bit."""
    pairs: Any = zip(a, b, strict=True)
    return all(np.array_equal(x, y, equal_nan=x.dtype.kind == "f") for x, y in pairs)
