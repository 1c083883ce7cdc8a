"""Symbolic dynamics: orbits from their codes, and the codes' addresses.

An address is a sequence of symbols with the half rotations between crossings. Which orbit has a
given one, the chain of its passages tells, solved all at once.

Chain parts
-----------
address   codes and addresses as texts
tables    the return map's inverse charts at one energy, with slopes
chain     the equations of a chain of passages, by Newton's method
shortest  chains with given half rotations, or with few
surface   the orbits of Fig. 4 as the beginning of a chain
refine    theta2_0 to any number of digits, by integration
confirm   every passage of a chain integrated alone
follow    the address of a given orbit
find      the orbit of a given address
round_phases phases of few decimals that have a code
closed    the periodic orbit of a word, its multiplier
closing   closed orbits verified by integration
action    their actions
stretching growth of deviations, finite-time Lyapunov exponents
exponents the same for many orbits of Fig. 4's kind at once
track     orbits of the unstable surface, followed by the map
skeleton  the doubly asymptotic orbits with short codes
doubly    the same to rounding, what theta3 gains along them
launch    starts on the unstable surface itself, in 106 bits
sharp     their phases to 30 digits
"""

from rigidpend.routes.symbolic.address import Address, AddressError
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.closed import ClosedOrbit, closed_orbit
from rigidpend.routes.symbolic.find import FoundOrbit, find_orbit
from rigidpend.routes.symbolic.follow import address_of

__all__ = [
    "Address",
    "AddressError",
    "ClosedOrbit",
    "FoundOrbit",
    "NoOrbit",
    "address_of",
    "closed_orbit",
    "find_orbit",
]
