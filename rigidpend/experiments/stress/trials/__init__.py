"""Trials at the limits of what the package says: each claim has a bound, declared before.

Modules
-------
claims      claims that a run may refute, their limits and verdicts
scenes      orbits and their starts, in some arithmetic and in another, and how far they are apart
growth      the rounding error of a crossing, predicted from the variational equations
extremes    bodies, energies and starts at the ends of their ranges
symmetries  reflection, time reversal, change of units
passages    growth of errors a passage; how many symbols a precision decides
honesty     flags `certain` where the tolerance is spoilt
spoilt_maps flags `certain` where the tables of return maps are spoilt
addresses   orbits found from random codes of random bodies, read back
long_time   integrals over up to 1e6 rotations, and the period of the pendulum
"""
