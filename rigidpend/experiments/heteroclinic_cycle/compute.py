"""Experiment `heteroclinic_cycle`: the graph of periodic orbits and separatrices (Fig. 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data.layout import datasets
from rigidpend.experiments.data.tree import Tree
from rigidpend.experiments.heteroclinic_cycle.layout import LAYOUT, START
from rigidpend.mechanics.coordinates import TURN
from rigidpend.mechanics.free_body import SEPARATRICES, separatrix_theta1
from rigidpend.numbers.alphabet import NO_SYMBOL
from rigidpend.routes.cycle import TURNS, Turn

if TYPE_CHECKING:
    from rigidpend.experiments.heteroclinic_cycle.schema import Config


class Edge(NamedTuple):
    """An edge of the graph as it is drawn: within one window of 4 pi."""

    start: str
    end: str
    theta1: tuple[float, float]
    J1: tuple[float, float]
    symbol: int
    again: bool
    """True if the edge repeats another one, 4 pi further."""


def compute(config: Config, means: Means) -> Tree:
    """Compute the graph of a config's body: vertices, edges and the two rectangles.

    Returns
    -------
    Tree
        The groups vertices, edges and rectangles.
    """
    body = config.problem.body
    theta1 = separatrix_theta1(body.alpha0, body.beta0)
    edges = [*separatrix_edges(theta1), *(turn_edge(turn, theta1) for turn in TURNS)]
    means.report(f"{len(SEPARATRICES)} separatrices, {len(TURNS)} turns")
    groups = {
        "vertices": _vertices(theta1),
        "edges": _edges(edges),
        "rectangles": _rectangles(edges),
    }
    return datasets(LAYOUT, groups)


def rises(number: int) -> bool:
    """True if J1 rises from 0 to J2 along a separatrix: see (sol_1)-(sol_22)."""
    return number % 2 == 0


def vertex(number: int, J1: float) -> str:
    """Label of a vertex: starred on J1 = J2."""
    return f"{number}*" if J1 else f"{number}"


def separatrix_edges(theta1: NDArray[np.float64]) -> list[Edge]:
    """Vertical edges in the flow's sense, the first once more at the window's end."""
    edges = []
    for number, x, again in [
        *((number, x, False) for number, x in zip(SEPARATRICES, theta1, strict=True)),
        (SEPARATRICES[0], theta1[0] + 2 * TURN, True),
    ]:
        J1 = (0.0, 1.0) if rises(number) else (1.0, 0.0)
        ends = (vertex(number, J1[0]), vertex(number, J1[1]))
        edges.append(Edge(*ends, (float(x), float(x)), J1, NO_SYMBOL, again))
    return edges


def turn_edge(turn: Turn, theta1: NDArray[np.float64]) -> Edge:
    """Horizontal edge of a turn, to smaller theta1 for symbol 0, to larger for 1."""
    J1 = 1.0 if rises(turn.arriving) else 0.0
    begin, end = float(theta1[turn.arriving - 1]), float(theta1[turn.leaving - 1])
    if (end > begin) != bool(turn.symbol):
        # The way leads through the window's end, where the lower one is once more.
        begin, end = (x + 2 * TURN if x == min(begin, end) else x for x in (begin, end))
    labels = (vertex(turn.arriving, J1), vertex(turn.leaving, J1))
    return Edge(*labels, (begin, end), (J1, J1), turn.symbol, False)


def _vertices(theta1: NDArray[np.float64]) -> dict[str, Any]:
    # The window is 4 pi wide, so that its right edge is its left one once more.
    numbers, x = [*SEPARATRICES, SEPARATRICES[0]], np.append(theta1, theta1[0] + 2 * TURN)
    labels = [vertex(number, J1) for J1 in (0.0, 1.0) for number in numbers]
    again = np.tile(np.arange(len(numbers)) >= len(SEPARATRICES), 2)
    return {
        "label": labels,
        "theta1": np.tile(x, 2),
        "J1": np.repeat([0.0, 1.0], len(numbers)),
        "again": again,
    }


def _edges(edges: list[Edge]) -> dict[str, Any]:
    start, end, theta1, J1, symbol, again = zip(*edges, strict=True)
    return {
        "from": start,
        "to": end,
        "theta1": np.array(theta1).T,
        "J1": np.array(J1).T,
        "symbol": np.array(symbol, dtype=np.uint8),
        "again": np.array(again),
    }


def _rectangles(edges: list[Edge]) -> dict[str, Any]:
    """Rectangles on both sides of the first separatrix."""
    # The two turns behind the first separatrix: what they span are the paper's two rectangles.
    sides = sorted((e for e in edges if e.start == vertex(START, 1.0)), key=lambda e: e.symbol)
    bounds = np.array([sorted(edge.theta1) for edge in sides]).T
    return {"name": ["left", "right"], "theta1": bounds}
