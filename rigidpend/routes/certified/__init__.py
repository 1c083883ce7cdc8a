"""Proofs for the exact problem: of the symbols of route codes, and of sets that cover each other.

`docs/certified.md` and `docs/full-shift.md` state the theorems, prove them, and say where each
hypothesis is checked. A hypothesis is H1 to H5 or C1 to C9 there, and here begins the text of what
is undecided.

Proofs
------
Every proof is polynomials, step by step, that an exact orbit cannot leave by more than a bound.
Along all of them goes the same chain: an orbit begins within a bound of the first step; at a joint
the jump is added; over a step the bound grows by the logarithmic norm of the field and by what the
polynomials' derivative differs from the field, their defect. Signs of M3 and Q beside the bound
then tell where the orbit crosses the section M3 = 0.

================= ============================ ======================== ========================
what is proven    symbols of one orbit         symbols of an interval   a set covers another
================= ============================ ======================== ========================
hypotheses        H1 to H5                     H1 to H5, of a family    C1 to C9
polynomials       `proof_data.Step`, in x      `FamilyStep`, in x and u the same, in x, u, v, w
they begin        `orbit.enclosed`             `intervals`, its starts  `sections.beginning`: C1
jump, defect      `passages`: joined, defects  the same                 the same: C2
growth            `passages.tube`              `passages.carried`       the same: C3
signs             `orbit.OrbitChecker`         `intervals.symbols`      `passages.arrival`: C4, C5
what follows      `orbit.proof_of`             `intervals.symbols`      `coverings`: C6, C7;
                                                                        `connections`: C8, C9
found by          `codes`, `approximation`     `interval_search`        `horseshoe`, `start_lines`,
                                                                        `chains`, `family_orbits`
certificate       `runs.certificate_files`     route_intervals          full_shift (Theorems 1 to
                                                                        4, 8 and 10) and
                                                                        `runs.orbit_proofs` (7)
again, by another scripts.check_certificate    scripts.check_intervals  scripts.check_full_shift,
                                                                        scripts.check_orbit
================= ============================ ======================== ========================

A certificate holds the numbers of sets and polynomials, and what they are said to prove. Whoever
checks it takes the former alone, proves, and compares; nothing is integrated. The second checkers
in `scripts` share no line with the package.

Modules that prove
------------------
From the bottom upwards; none imports one that finds.

proof_data   data of proofs: sets, lines of starts and steps, and these as arrays; the refusal
             where nothing is proven
balls        enclosures of numbers, and the logarithmic norm
models       polynomials over the integers with a bound on their distance from functions
sections     numbers of a body; sets and lines, and where their orbits begin (C1)
passages     how far orbits get from polynomials on each step, and where they cross (C2 to C5)
orbit        crossings and symbols of one orbit (H1 to H5)
intervals    symbols that all orbits starting on an interval have
coverings    relations between sets that follow (C6, C7), and what these prove together
connections  orbits beside the sets, and how surfaces cross (C8, C9)

Modules that find
-----------------
Nothing of theirs need be trusted.

approximation    polynomials of one orbit, in any precision
codes            proofs of route codes, in more bits where the first do not suffice
horseshoe        sets of a full shift, and the ways they are tried
family_orbits    polynomials of the orbits of sets
start_lines      lines of starts that cross sets, and polynomials of their orbits
chains           small sets along an orbit, each of which covers the next
interval_search  intervals with their polynomials
"""
