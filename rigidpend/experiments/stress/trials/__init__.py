"""Trials at the limits of what the package says: each claim has a bound, declared before.

Modules
-------
claims      claims that a run may refute, their limits and verdicts
principal   orbits in principal axes, another formulation
truth       orbits in some arithmetic and in another, and how far apart two computations are
dual        derivatives of fields, by dual numbers
growth      the rounding error of a crossing, predicted from the variational equations
long_time   integrals over up to 1e6 rotations
pendulum    the motion with J1 = 0 against its period
extremes    bodies, energies and J1_0 at the ends of their ranges
starts      on and beside each separatrix, with any M . gamma
symmetries  reflection, time reversal, change of units
passages    growth of errors a passage; how many symbols a precision decides
honesty     flags `certain` where the tolerance is spoilt
spoilt_maps flags `certain` where the tables of return maps are spoilt
addresses   orbits found from random codes of random bodies, read back
"""
