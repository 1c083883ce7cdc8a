"""Poinsot's picture of the free body (mu = 0): an ellipsoid rolls on a plane, in closed form.

========== ===================================================================
orbit      an orbit by its height, its energy or a state
polhode    the orbit of M and omega in the body, by Jacobi's functions of time; the ellipsoid (el)
herpolhode the same angular velocity in space, by elliptic integrals
spiral     the separatrix: half an ellipse and a spiral, elementary, with their length
========== ===================================================================

An orbit is given by its height, the largest |M3|/|M|, together with its coheight
sqrt(1 - height^2): what is small of the two is given, not formed. The energy is
2 h0/|M|^2 = 1/A3 +- (const coheight)^2, so that orbits at any distance from the separatrix, or
from the permanent rotations (height 0), keep their relative precision.

For instance::

    orbit = encircling(body, axis=2, side=1, G=2.0, coheight=1e-10)
    M, omega = momentum(orbit, t), herpolhode(orbit, t)
    angle_per_period(orbit), radii(orbit)

All quantities are physical, in physical time t. Components come first, samples after.
"""
