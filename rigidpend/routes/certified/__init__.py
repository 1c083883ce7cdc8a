"""Proofs for the exact problem: of the symbols of route codes, and of sets that cover each other.

`docs/certified.md` and `docs/full-shift.md` state the theorems, prove them, and say where each
hypothesis is checked.

Modules that prove
------------------
balls, models
             enclosures of the problem's numbers, logarithmic norm, polynomials over the integers
pieces       data of proofs: steps of an orbit and of families, sets in which families begin
checker      what is said where nothing is proven
sections, passages
             sets of the section M3 = 0, where their orbits begin, how far they are from polynomials
             on each step, and where they next cross the section
orbit, intervals
             symbols of one orbit, and those that all orbits starting on an interval have
coverings, connections
             relations between sets that follow; orbits beside the sets, and how surfaces cross

Modules that find polynomials and sets, and need not be trusted
----------------------------------------------------------------
approximation
             polynomials of an orbit
interval_search
             intervals with their polynomials
horseshoe, family_orbits, start_lines, chains
             sets and the ways they are tried, their orbits, lines of starts, sets along an orbit

`codes` does both: it finds proofs of route codes, and checks given ones by the checker.
"""
