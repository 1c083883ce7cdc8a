"""The heavy rigid body and its motions in closed form; nothing here is integrated.

Modules
-------
The body and its equations:

body          the rigid body, its angles, the conditions on both
coordinates   maps between the descriptions of a state
equations     equations of motion and Hamiltonians
jacobi        Jacobi's elliptic functions, precise up to k = 1

The free body, mu = 0 (Euler case):

free_body     orbits on the sphere of M, separatrices as motions in time, the cycle of Fig. 2

Pendulum motions and periodic orbits:

pendulum      pendulum motions, exact at any mu; motions beside these, to first order in mu
floquet       the same orbits to rounding, with their Floquet multipliers

The motion in space:

in_space      increments of theta3 along the separatrices, the angular velocity in fixed space
"""
