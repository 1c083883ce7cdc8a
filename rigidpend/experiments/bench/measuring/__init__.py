"""Benchmark: speed, error and trust of rigidpend beside other methods, each at its best.

tasks      what a method is asked for, and what it answers with
problems   the five problems, each with its error and its reference
methods    ours and the others, with the settings that are tried for each
fields     the equations as the methods integrate them, also as plain Python
protocol   how methods are searched and timed in turn
choice     which setting of a method goes to a meeting with the others
phases     wrong symbols on random phases
many       time against the number of orbits
worker     measurements in a process of their own
records    the data of a measurement
reading    what the data says: ratios, losses, tables

Peers
-----
heyoka in batches of 1 to 16 lanes, full or compact, on Euler-Poisson and (eq1), and its ensemble;
CyRK (DOP853, Verner 8, LSODA) with rates compiled by numba; diffrax (Dopri8, Tsit5), jitted and
vmapped; SciPy (DOP853 abreast or one by one, LSODA, Radau); SUNDIALS' CVODE (Adams, BDF) through
scikit-sundae; REBOUND's interface to equations, rates compiled.

Looked at and left out: numbalsoda, extensisq, pyodesys, pycvodes, sundials4py, scikits.odes and
Assimulo have no wheel for Linux and Python 3.11 (CyRK serves numbalsoda's LSODA and DOP853);
JiTCODE compiles with the system's C compiler and has no events; torchdiffeq and torchode bring
PyTorch, which weighs more than all others together, for the methods that diffrax has; numbakit-ode
has had no release since 2022 and offers DOP853, as CyRK does; desolver steps in plain Python;
nodepy analyses methods and does not mean to be fast; CasADi calls CVODE, which is here.
"""
