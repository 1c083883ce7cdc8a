"""Trials at the limits: each claim has a bound, declared before the run; a run may refute it.

claims      claims, their limits and verdicts; a trial tests some of them by one measurement
scenes      orbits and their starts, in some arithmetic and in another, and how far they are apart
growth      the rounding error of a crossing, predicted from the variational equations
extremes    bodies, energies and starts at the ends of their ranges
symmetries  reflection, time reversal, change of units
passages    growth of errors a passage; how many symbols a precision decides
honesty     flags `certain` where the tolerance, or the tables of return maps, are spoilt
addresses   orbits found from random codes of random bodies, read back
long_time   integrals over up to 1e6 rotations, and the period of the pendulum
compute, layout, report, draw
            the experiment: all trials in their order, stored, told and drawn
"""
