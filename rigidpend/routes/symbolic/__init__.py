"""Symbolic dynamics: orbits from their codes, and the codes' addresses.

An address is a sequence of symbols with the half rotations between crossings. The orbit of a given
address is found as a chain of passages, whose equations are solved all at once: from a start of
Fig. 4 on, for a closed orbit, or from one asymptotic surface to another.

Parts
-----
address    codes and addresses as text
levels     the return map's inverse charts at one energy, and the orbits of Fig. 4 on it
chain      the equations of a chain of passages, for all kinds of ends; passages integrated alone
shortest   chains with given half rotations, or with as few as possible
follow     the address of a given orbit, and the round phases that have a code
legs       an orbit cut into legs, whose integrations Newton's method lets meet
refine     theta2_0 to any number of digits, by corrections of its legs
find       the orbit of a given address
closed     the periodic orbit of a word, its multiplier and action; a check by integration
stretching growth of deviations, finite-time Lyapunov exponents
asymptotic doubly asymptotic orbits with short codes, and the growth of theta3 along them
sharp      the phases of these to 30 digits, from starts on the unstable surface itself
"""

from rigidpend.routes.symbolic.address import Address
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.closed import ClosedOrbit, closed_orbit
from rigidpend.routes.symbolic.find import FoundOrbit, find_orbit
from rigidpend.routes.symbolic.follow import address_of

__all__ = [
    "Address",
    "ClosedOrbit",
    "FoundOrbit",
    "NoOrbit",
    "address_of",
    "closed_orbit",
    "find_orbit",
]
