"""Curves of Fig. 1 as the file holds them, each with its look."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

from rigidpend.experiments.data.tree import Data
from rigidpend.experiments.plots.palette import BLUE, GREEN, PINK, RED


class CurveLook(NamedTuple):
    """Look of a kind of curve."""

    colour: str
    pale: str
    width: float
    style: Any
    label: str

    @property
    def line(self) -> dict[str, Any]:
        """Arguments of `Axes.plot` for the curve."""
        return {"color": self.colour, "lw": self.width, "ls": self.style}


ORBITS = {
    1: CurveLook(PINK, "#EFD6E4", 0.9, "-", r"orbits around $\pm M_1$"),
    2: CurveLook(GREEN, "#B3DDD0", 0.9, "-", r"orbits around $\pm M_2$"),
}
"""Looks of the orbits by the axis that they encircle."""
RISING = CurveLook(BLUE, "#A3CBE3", 2.2, "-", "separatrices 2, 4 (up)")
FALLING = CurveLook(RED, "#F1C09C", 1.8, (0, (4, 1)), "separatrices 1, 3 (down)")

FLAT = ("projected", "visible", "theta1", "J1")
"""Fields with a value at each point."""


class Curve(NamedTuple):
    """One curve of the result."""

    name: str
    look: CurveLook
    projected: Any
    visible: Any
    theta1: Any
    J1: Any
    arrows: Any
    """Indices of the points that bear an arrow."""


def _curves(group: Data, names: list[str], looks: list[CurveLook]) -> list[Curve]:
    """Cut the curves of a group from its flat arrays."""
    found = []
    for (a, b), name, look in zip(pairwise(group["offsets"]), names, looks, strict=True):
        flat = {field: group[field][..., a:b] for field in FLAT}
        inside = (group["arrows"] >= a) & (group["arrows"] < b)
        found.append(Curve(name, look, **flat, arrows=group["arrows"][inside] - a))
    return found


def all_curves(data: Data) -> list[Curve]:
    """List every orbit, then the separatrices, which lie above."""
    axes, numbers = data["orbits"]["around"], data["separatrices"]["number"]
    looks = [separatrix_look(int(i)) for i in numbers]
    return [
        *_curves(data["orbits"], ["orbit"] * len(axes), [ORBITS[int(i)] for i in axes]),
        *_curves(data["separatrices"], [f"separatrix {i}" for i in numbers], looks),
    ]


def separatrix_look(number: int) -> CurveLook:
    """Look of a separatrix; equal on a circle."""
    return RISING if number % 2 == 0 else FALLING
