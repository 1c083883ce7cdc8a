"""Routes computed in 113 bits without this package: see `source` in each file."""

import functools
import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend import Body
from rigidpend.experiments.bench import measure

DATA = Path(__file__).parent.parent / "data"


class Reference(NamedTuple):
    """Orbits of the body of Fig. 4, columns of arrays as in `RouteCodes`."""

    body: Body
    h0: str
    J1_0: str
    theta2_0: list[Any]
    """Texts where the phases are decimal fractions, else doubles."""
    codes: NDArray[np.uint8]
    """(15, n)."""
    crossing_time: NDArray[np.float64]
    """(16, n), or (1, n): the last one only."""
    theta1: NDArray[np.float64]
    """(16, n), not reduced, 4 decimals; empty where it is not in the file."""


@functools.cache
def fig4_left() -> Reference:
    read = json.loads((DATA / "fig4_left_113bit.json").read_text())
    return _reference(read, read["J1_0"], read["orbits"])


@functools.cache
def random_phases(J1_0: str) -> Reference:
    """2000 phases drawn at random, for J1_0 = "1e-6" or "1e-10"."""
    read = json.loads(measure.STORED.read_text())
    return _reference(read, J1_0, read["orbits"][J1_0])


def _reference(read: Any, J1_0: str, orbits: Any) -> Reference:
    phases, codes, times, *theta1 = (list(column) for column in zip(*orbits, strict=True))
    bits = np.array([[int(z) for z in code] for code in codes], dtype=np.uint8)
    each = (np.array(x).reshape(len(phases), -1).T for x in (bits, times, theta1))
    return Reference(Body(read["A"], read["r"], read["mu"]), read["h0"], J1_0, phases, *each)


def vertex_theta1(separatrix: Any) -> NDArray[np.float64]:
    """theta1 of the separatrices 1..4 of Fig. 4, from (sol_1), (sol_2), (sol_12), (sol_22)."""
    alpha0, beta0 = math.acos(-1 / 3), math.pi / 2
    places = [math.nan, beta0 - alpha0, beta0 + alpha0]
    places += [place + 2 * math.pi for place in places[1:]]
    return np.array(places)[separatrix]
