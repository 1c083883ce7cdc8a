"""The body and energy of the tests of doubly asymptotic orbits: those of Fig. 4."""

from __future__ import annotations

import functools

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.return_map import return_map
from rigidpend.routes.symbolic.doubly import DoublyAsymptotic, doubly_asymptotic
from rigidpend.routes.symbolic.sharp import Launch
from rigidpend.routes.symbolic.skeleton import Skeleton, skeleton
from rigidpend.routes.symbolic.tables import Level

BODY = Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001")
H, J1_0 = exact("1.3342"), exact("1e-8")
HALF_TURNS = 10


@functools.cache
def level() -> Level:
    """The return map at their energy."""
    return Level(return_map(BODY, h=H), float(H))


@functools.cache
def rough(symbols: int) -> list[Skeleton]:
    """The orbits with up to so many symbols, unpolished."""
    return skeleton(level(), symbols, HALF_TURNS)


@functools.cache
def orbits(n: int) -> DoublyAsymptotic:
    """The orbits with n symbols."""
    return doubly_asymptotic(level(), rough(n)[n])


@functools.cache
def launch() -> Launch:
    """Their starts."""
    return Launch(BODY, level(), H, J1_0)
