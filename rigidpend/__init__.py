"""rigidpend: perturbed pendulum-like motions of a heavy rigid body about a fixed point.

Reproduces, checks and extends the paper of that name by I. N. Gashenenko, "the paper" below.
Data flows one way: config -> experiment -> workers -> HDF5 -> render.

From a notebook::

    import rigidpend

    body = rigidpend.Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.001")
    routes = rigidpend.route_codes(body, ["1/10", "2/10"], h0="1.3342", J1_0="1e-8")
    routes.codes, routes.certain

Rooms
-----
exact         numbers taken exactly as written; expressions reads them from texts
body          the rigid body and its angles
coordinates   maps between descriptions of a state
equations     equations of motion and Hamiltonians
free_body     orbits without weight on the sphere of M, in closed form
poinsot       the free body in time: ellipsoid, polhode, herpolhode, separatrix
separatrices  the unperturbed separatrices as motions in time
pendulum      the pendulum motions, exact
jacobi        Jacobi's elliptic functions, precise up to k = 1
riccati       theta1 beside a pendulum motion
periodic      the periodic orbits to first order in mu
floquet       the periodic orbits to rounding, with their multipliers
variational   orbits beside a separatrix, to first order
melnikov      Melnikov's integral on the four separatrices, its zeros
surfaces      the asymptotic surfaces S1- and S2+ as curves
asymptotic    the surfaces on the section J1 = J2/2: splitting, heteroclinic orbits
precession    increments of theta3 along the separatrices, their order
hodograph     the angular velocity in the fixed space
herpolhode    an orbit along its route, with its hodograph
integrate     engines: `taylor`, `scipy`, and integers of any precision
routes        binary route codes, with their certainty
return_map    orbits and their codes without integration, by a normal form
config        YAML configs, read and checked; catalogue names them
experiments   what a config can ask for
runner        which experiments are run, and why
workers       threads and processes; signals end them from outside
tree, store   the data of a result; its HDF5 file
files         written whole or not at all, sealed; damage tells which are safe to open
parts         what an interrupted run has finished; locks tell who is at work
compare       where two results differ; regression compares with references
progress      how a run goes; logs keep it beside the results
theory        what the formulas say of a body, as a table
provenance    versions, commit, machine, and the code behind a result
render        figures from stored results
report        one HTML page of all results, beside the paper's numbers
departures    where the paper slips, and what is computed here
stress        trials at the limits, each with a stated bound
benchmark     speed and error beside other methods
cli           the command line

Names
-----
Letters are the paper's, in ASCII.

============= =================================================== ===================
name          meaning                                             unit, shape
============= =================================================== ===================
A, r, mu      moments of inertia, direction to the centre of      physical, (3,) (3,)
              gravity, weight times its distance
alpha0,       angles of the mass distribution (phi)               radians
beta0, gamma0
kappa, nu     A1 A2/(A3 (A1 - A2)); pi kappa/sin(alpha0)          1
M, gamma      angular momentum, upward vertical, body axes        physical, (3, ...)
omega         angular velocity                                    physical, (3, ...)
G, L, H,      Andoyer-Deprit variables                            physical; radians
g, l, h
J1, J2, J3    canonical actions; J2 = \\|M\\|, J3 = M . gamma       dimensionless or
                                                                  physical, said where
theta1..3     canonical angles; theta1 modulo 4 pi                radians
Qp, Qm, M3    separatrix-aligned components of M                  dimensionless
h0            energy constant, kappa J2_0^2/2                     1
t, t'         time; t' = t s, s = sqrt((A1 - A2)/(A1 A2))         physical; 1
============= =================================================== ===================

In arrays the component, the symbol or the crossing comes first, the sample or orbit after.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidpend.body import Body as Body
    from rigidpend.return_map import return_map as return_map
    from rigidpend.routes import RouteCodes as RouteCodes
    from rigidpend.routes import route_codes as route_codes

__version__ = "0.1.0"
__all__ = ["Body", "RouteCodes", "return_map", "route_codes"]

_HOME = {
    "Body": "rigidpend.body",
    "RouteCodes": "rigidpend.routes",
    "return_map": "rigidpend.return_map",
    "route_codes": "rigidpend.routes",
}


def __getattr__(name: str) -> Any:
    """The public names, imported when first used: the command line starts without numpy."""
    if name not in _HOME:
        raise AttributeError(f"module 'rigidpend' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
