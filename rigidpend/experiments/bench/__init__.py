"""Benchmark: speed, error and trust of rigidpend beside other methods, each at its best.

methods    problems and methods as data: what is tried for each, and which setting is chosen
problems   the task of each problem, its truth and its error; bodies drawn by lot
solvers    a method made ready for a task; the equations as methods integrate them
ours, heyoka_batches, cyrk_compiled, diffrax_vmapped, scipy_abreast
           the adapters, one a library: ``answered(task, knob, threads, **setting)``
protocol   how methods are searched and timed in turn
counts     symbols on random phases, on ever more orbits, and of bodies drawn by lot
worker     measurements in a process of their own
compute, layout, report, draw
           the experiment: what is measured in which order, stored, told and drawn

Peers
-----
heyoka in batches of 4 to 16 lanes, on Euler-Poisson and (eq1); CyRK (DOP853, Verner 8, LSODA) with
rates compiled by numba; diffrax (Dopri8, Tsit5), jitted and vmapped; SciPy's DOP853, all orbits
as one system.

Measured before, and left out since: SciPy's LSODA and Radau, SUNDIALS' CVODE through scikit-sundae
and REBOUND's Bulirsch-Stoer took 190 to 17,000 times our time at every problem; heyoka's ensemble,
its compact mode and its integrator of one orbit more than its batches; our own 64 and 113 bits
145 and 3,600 times our doubles.

Looked at and left out: numbalsoda, extensisq, pyodesys, pycvodes, sundials4py, scikits.odes and
Assimulo have no wheel for Linux and Python 3.11 (CyRK serves numbalsoda's LSODA and DOP853);
JiTCODE compiles with the system's C compiler and has no events; torchdiffeq and torchode bring
PyTorch, which weighs more than all others together, for the methods that diffrax has; numbakit-ode
has had no release since 2022 and offers DOP853, as CyRK does; desolver steps in plain Python;
nodepy analyses methods and does not mean to be fast; CasADi calls CVODE.
"""
