"""Experiment `heteroclinic_cycle`: the graph of periodic orbits and separatrices (Fig. 2)."""

from typing import Any

import numpy as np

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.heteroclinic_cycle import EDGES, START
from rigidpend.experiments.heteroclinic_cycle.schema import Config
from rigidpend.mechanics.coordinates import TURN
from rigidpend.mechanics.free_body import SEPARATRICES, TURNS, direction, separatrix_theta1
from rigidpend.numbers import Array
from rigidpend.numbers.texts import NO_SYMBOL


def compute(config: Config, means: Means) -> Tree:
    """Compute the graph of a config's body: vertices, edges and the two rectangles."""
    body = config.problem.body
    theta1 = separatrix_theta1(body.alpha0, body.beta0)
    # The window is 4 pi wide: its right edge is the same separatrix as its left edge.
    numbers, places = [*SEPARATRICES, SEPARATRICES[0]], [*theta1, theta1[0] + 2 * TURN]
    again = [k == len(SEPARATRICES) for k in range(len(numbers))]
    vertical = [_separatrix_edge(*one) for one in zip(numbers, places, again, strict=True)]
    edges = [*vertical, *(_turn_edge(turn, theta1) for turn in TURNS)]
    means.report(f"{len(SEPARATRICES)} separatrices, {len(TURNS)} turns")
    # The two turns after the first separatrix span the paper's two rectangles.
    left, right = sorted((x for x in edges if x[0] == _label(START, 1.0)), key=lambda x: x[4])
    return {
        "vertices": {
            "label": [_label(number, J1) for J1 in (0.0, 1.0) for number in numbers],
            "theta1": np.tile(places, 2),
            "J1": np.repeat([0.0, 1.0], len(numbers)),
            "again": np.tile(again, 2),
        },
        "edges": {
            name: np.array(values).T
            for name, values in zip(EDGES, zip(*edges, strict=True), strict=True)
        },
        "rectangles": {
            "name": ["left", "right"],
            "theta1": np.array([sorted(left[2]), sorted(right[2])]).T,
        },
    }


def _label(number: int, J1: float) -> str:
    return f"{number}*" if J1 else f"{number}"


def _separatrix_edge(number: int, place: float, again: bool) -> tuple[Any, ...]:
    """The fields of the vertical edge of a separatrix, in the direction of the flow."""
    J1 = (0.0, 1.0) if direction(number) == 1 else (1.0, 0.0)
    return *(_label(number, x) for x in J1), (place, place), J1, np.uint8(NO_SYMBOL), again


def _turn_edge(turn: tuple[int, int, int], theta1: Array) -> tuple[Any, ...]:
    """The fields of the edge of a turn, to smaller theta1 for symbol 0, to larger for 1."""
    arriving, leaving, symbol = turn
    J1 = 1.0 if direction(arriving) == 1 else 0.0
    begin, end = float(theta1[arriving - 1]), float(theta1[leaving - 1])
    # Two separatrices may lie at one place, where alpha0 rounds to pi or is lost beside beta0.
    if (end < begin) if symbol else (end > begin):
        # The turn leaves the window: its lower end is drawn again 4 pi further.
        begin, end = (x + 2 * TURN if x == min(begin, end) else x for x in (begin, end))
    labels = (_label(number, J1) for number in (arriving, leaving))
    return *labels, (begin, end), (J1, J1), np.uint8(symbol), False
