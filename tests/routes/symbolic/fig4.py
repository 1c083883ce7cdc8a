"""The body and energy of these tests, those of Fig. 4, and orbits of them."""

import functools
from typing import Any

import numpy as np

from rigidpend.numbers.exact import exact
from rigidpend.routes.symbolic import asymptotic
from rigidpend.routes.symbolic.asymptotic import Track, doubly_asymptotic, skeleton
from rigidpend.routes.symbolic.chain import Chain, System, on_surface, signs_of
from rigidpend.routes.symbolic.levels import ChainLevel
from rigidpend.routes.symbolic.sharp import Launch
from rigidpend.routes.symbolic.shortest import chain_through
from tests.bodies import FIG4

BODY = FIG4
H, J1_0 = exact("1.3342"), exact("1e-8")
HALF_TURNS = 10


@functools.cache
def level() -> ChainLevel:
    """The return map at their energy."""
    return ChainLevel.of(BODY, H)


@functools.cache
def rough(symbols: int) -> list[Track]:
    """The orbits with up to so many symbols, unpolished."""
    return [one for one, _ in skeleton(level(), symbols, HALF_TURNS)]


@functools.cache
def orbits(n: int) -> asymptotic.DoublyAsymptotic:
    """The orbits with n symbols."""
    return doubly_asymptotic(level(), rough(n)[n])


@functools.cache
def launch() -> Launch:
    """Their starts."""
    return Launch(level(), J1_0)


def chain_of(symbols: Any) -> Chain:
    """A chain from the unstable surface on, 11 half rotations a passage."""
    system = System(level(), on_surface, signs_of(np.array(symbols)))
    return chain_through(system, 11 * np.arange(len(symbols) + 1), 0.0)
