"""rigidpend: perturbed pendulum-like motions of a heavy rigid body about a fixed point.

Reproduces, checks and extends the paper of that name by I. N. Gashenenko, "the paper" below.
Data flows one way: config -> experiment -> workers -> HDF5 -> render.

From a notebook::

    import rigidpend

    body = rigidpend.Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.001")
    routes = rigidpend.route_codes(body, ["1/10", "2/10"], h0="1.3342", J1_0="1e-8")
    routes.codes, routes.certain

Modules
-------
In the order of the subject; each folder's own docstring lists its modules.

The body and its equations:

body          the rigid body, its angles, the conditions on both
coordinates   maps between the descriptions of a state
equations     equations of motion and Hamiltonians
jacobi        Jacobi's elliptic functions, precise up to k = 1

The free body, mu = 0 (Euler case):

free_body     orbits on the sphere of M, in closed form
poinsot/      the free body in time: ellipsoid, polhode, herpolhode, separatrix
separatrices  unperturbed separatrices as motions in time

Pendulum motions and periodic orbits:

pendulum      pendulum motions, exact at any mu
riccati       motions beside a pendulum motion, to first order
periodic      hyperbolic periodic orbits to first order in mu
floquet       the same orbits to rounding, with their Floquet multipliers

Asymptotic surfaces and chaos:

variational   orbits beside a separatrix, to first order
melnikov      Melnikov's integral on the four separatrices, its zeros
surfaces      asymptotic surfaces S1- and S2+ as curves
asymptotic/   the surfaces on the section J1 = J2/2: splitting, heteroclinic orbits
integrate/    integration up to the section: engines `taylor`, `scipy`, arbitrary precision
routes/       route codes, with the certainty of every symbol
certified/    route codes, with a proof of every symbol

The motion in space:

precession    increments of theta3 along the separatrices, their order
hodograph     the angular velocity in the fixed space
herpolhode    an orbit along its route, with its hodograph
return_map/   orbits and their codes without integration, by a normal form
symbolic/     orbits from their codes, addresses

The runner:

numbers/      numbers taken exactly as written
config/       YAML configs, read and checked with the place of every value
experiments/  one folder each: schema, computation, drawing, report
run/          plans, workers, progress, logs, checkpoints, provenance
results/      HDF5 files of results, their safety and comparison
render/       figures from stored results
report/       one HTML page of all results, beside the paper's numbers
tables        one table, for a terminal, in Markdown or HTML
description   rows of name, value and meaning
theory        the theory's values for a body, as such rows
departures    departures from the paper
notebook      results loaded, computed and drawn in a line; orbits in time
measure/      benchmark beside other methods, and stress trials
cli/          the command line

Words
-----
The paper's words, or this package's, beside those of dynamical systems.

========================= ==================================================
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
    from rigidpend.mechanics.body import Body as Body
    from rigidpend.notebook import StoredResult as StoredResult
    from rigidpend.notebook import load as load
    from rigidpend.notebook import orbit as orbit
    from rigidpend.notebook import plot as plot
    from rigidpend.notebook import run as run
    from rigidpend.notebook import theory as theory
    from rigidpend.orbits.return_map import return_map as return_map
    from rigidpend.routes import RouteCodes as RouteCodes
    from rigidpend.routes import route_codes as route_codes
    from rigidpend.routes.certified.codes import CertifiedCodes as CertifiedCodes
    from rigidpend.routes.certified.codes import certify_codes as certify_codes
    from rigidpend.routes.symbolic import FoundOrbit as FoundOrbit
    from rigidpend.routes.symbolic import address_of as address_of
    from rigidpend.routes.symbolic import find_orbit as find_orbit

__version__ = "0.2.0"
__all__ = [
    *("Body", "CertifiedCodes", "FoundOrbit", "RouteCodes", "StoredResult", "address_of"),
    *("certify_codes", "find_orbit", "load", "orbit", "plot", "return_map", "route_codes"),
    *("run", "theory"),
]

_HOME = {
    "Body": "rigidpend.mechanics.body",
    "CertifiedCodes": "rigidpend.routes.certified.codes",
    "FoundOrbit": "rigidpend.routes.symbolic",
    "RouteCodes": "rigidpend.routes",
    "StoredResult": "rigidpend.notebook",
    "address_of": "rigidpend.routes.symbolic",
    "certify_codes": "rigidpend.routes.certified.codes",
    "find_orbit": "rigidpend.routes.symbolic",
    "load": "rigidpend.notebook",
    "orbit": "rigidpend.notebook",
    "plot": "rigidpend.notebook",
    "return_map": "rigidpend.orbits.return_map",
    "route_codes": "rigidpend.routes",
}
"""Module that each public name comes from."""

_CALLED = ("run", "theory")
"""Modules that are also functions: ``rigidpend.run("fig4")``, ``rigidpend.theory(body, h0)``."""


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that the command line starts without numpy."""
    if name not in _HOME and name not in _CALLED:
        raise AttributeError(f"module 'rigidpend' has no attribute {name!r}")
    import importlib

    if name in _CALLED:
        # A module that is called as a function: it makes itself known as an attribute here.
        return importlib.import_module(f"rigidpend.{name}")
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME, *_CALLED])
