"""The flags `certain` where the tolerance is spoilt: wrong symbols come, flagged ones do not."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.body import Body
from rigidpend.measure.stress.cases import Case, tree
from rigidpend.results.tree import Dataset, Tree
from rigidpend.routes import RouteCodes, route_codes

STARTS = ("1e-6", "1e-8", "1e-10")
"""J1_0 of a third of the orbits each."""


def block(
    body: Body,
    h0: Any,
    J1_0: str,
    tolerances: Sequence[str],
    *,
    orbits: int,
    n_symbols: int,
    seed: int,
    engine: str,
    jobs: int,
) -> Tree:
    """Doubles alone at spoilt tolerances, against the default precisions and tolerance.

    Parameters
    ----------
    body : Body
    h0, J1_0 : number
    tolerances : sequence of str
        Decimal.
    orbits, n_symbols : int
    seed : int
        Of the random phases.
    engine : str
    jobs : int
    """
    random = np.random.default_rng((seed, *J1_0.encode()))
    phases = random.uniform(0, 2 * np.pi, orbits)
    routes = partial(
        route_codes, body, phases, h0=h0, J1_0=J1_0, n_symbols=n_symbols, engine=engine, jobs=jobs
    )
    true = routes()
    spoilt = (routes(tolerance=float(x), precisions=(53,)) for x in tolerances)
    counts = np.array([counted(x, true) for x in spoilt]).T
    symbols, wrong, lies = counts
    cases = [
        Case(
            f"lies at {tolerance}, J1_0 = {J1_0}",
            f"wrong symbols called certain, of {symbols[k]} with {wrong[k]} wrong",
            "1",
            float(lies[k]),
            0,
            "no wrong symbol is called certain",
        )
        for k, tolerance in enumerate(tolerances)
    ]
    unknown = Case(
        f"unknown, J1_0 = {J1_0}",
        f"symbols without a truth, of {true.codes.size}",
        "1",
        float((~true.certain).sum()),
        0,
        "the default precisions decide every symbol of these orbits",
    )
    curves = {
        "tolerance": Dataset(np.array(list(map(float, tolerances))), "1", "local, spoilt"),
        "symbols": Dataset(symbols, "1", "symbols compared"),
        "wrong": Dataset(wrong, "1", "of them wrong at this tolerance"),
        "lies": Dataset(lies, "1", "of them wrong and called certain"),
    }
    return tree([*cases, unknown], curves)


HARD = Body((2, 1, "3/2"), (1, 1, 0), "1/1000")
HARD_START: dict[str, Any] = {"h0": "1.3342", "J1_0": 1e-8, "n_symbols": 32}
HARD_PHASE = 3.453198983306014
"""An orbit whose error outruns the difference of two computations twentyfold, at 64 bits."""


def hard_orbit(engine: str) -> Tree:
    """The default precisions on the orbit on which two computations once hid a radian."""
    routes = partial(route_codes, HARD, [HARD_PHASE], engine=engine, **HARD_START)
    _, wrong, lies = counted(routes(), routes(precisions=(113,)))
    case = Case(
        "lies on a hard orbit",
        f"wrong symbols called certain, of 32 with {wrong} wrong",
        "1",
        float(lies),
        0,
        "no wrong symbol is called certain, whatever precision decides",
    )
    return tree([case])


def counted(spoilt: RouteCodes, true: RouteCodes) -> NDArray[np.int64]:
    """Symbols with a truth, wrong ones among them, and wrong ones called certain."""
    known, differ = true.certain, spoilt.codes != true.codes
    sets = (known, known & differ, known & differ & spoilt.certain)
    return np.array([x.sum() for x in sets], dtype=np.int64)
