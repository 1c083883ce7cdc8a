"""Proofs for the exact problem: of the symbols of route codes, and of sets that cover each other.

`docs/certified.md` and `docs/full-shift.md` state the theorems and prove them; they name the
function that checks each hypothesis.

What proves
-----------
balls, models
             enclosures of the problem's numbers, logarithmic norm, polynomials over the integers
pieces       data of proofs: steps of an orbit, and of families, with the sets they begin in
checker      symbols of one orbit
intervals    those of all orbits that start on an interval
sections, passages, coverings, connections
             sets, where their orbits begin, next cross, what that covers, and what follows beside

What finds, and need not be trusted
-----------------------------------
approximation, codes
             polynomials of an orbit, route codes made of them and the checker
interval_search
             intervals with their polynomials
horseshoe, family_orbits, chains
             sets and the ways they are tried, their orbits, lines of starts, sets along an orbit
"""
