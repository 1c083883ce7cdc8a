"""rigidpend: perturbed pendulum-like motions of a heavy rigid body about a fixed point.

Reproduces, checks and extends the paper of that name by I. N. Gashenenko, "the paper" below.
Data flows one way: config -> experiment -> workers -> HDF5 -> render.

From a notebook::

    import rigidpend

    body = rigidpend.Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.001")
    routes = rigidpend.route_codes(body, ["1/10", "2/10"], h0="1.3342", J1_0="1e-8")
    routes.codes, routes.certain

Folders
-------
Each imports only from those below it (`.importlinter` holds that), so that the subject is read
from the bottom upwards. A folder's own docstring lists what is in it.

============ ===================================================================
cli/         the command line, a thin module for each command; `notebook` is its
             twin for Python
render/      figures from stored results, and one page of all of them
runs/        from configs to results: plans, parts, progress, provenance
results/     HDF5 files of results: written whole, opened as data only, safe
experiments/ one folder each: layout, schema, computation and drawing; with
             contract.py, which they obey, and plots.py, which they share
config/      YAML configs, read and checked with the place of every value
surfaces/    asymptotic surfaces S1- and S2+: Melnikov, splitting, heteroclinic
routes/      route codes of orbits, each symbol certain or not; in symbolic/ the
             inverse, orbits from codes; in certified/ codes with a proof
orbits/      orbits followed: step by step in integrate/, from section to
             section by a normal form in return_map/
mechanics/   the body, its equations, and its motions in closed form
machine/     the computer around it: files, caches, workers, signals
numbers/     numbers taken exactly as they are written
============ ===================================================================

Words
-----
The paper's words, or this package's, beside those of dynamical systems.

========================= ==================================================
pendulum motion           periodic orbit at J1 = 0 or J1 = J2
asymptotic surface        stable, unstable manifold of a periodic orbit
doubly asymptotic orbit   heteroclinic orbit
passage                   one application of the return map
symbol, route code        letter, itinerary: 0 left, 1 right
address                   itinerary with the half rotations of each passage
heteroclinic cycle        transition graph
multiplier                Floquet multiplier, of the monodromy matrix
herpolhode                curve of the angular velocity in space
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
    from rigidpend.routes.certified.codes import CertifiedCodes as CertifiedCodes
    from rigidpend.routes.certified.codes import certify_codes as certify_codes
    from rigidpend.routes.codes import RouteCodes as RouteCodes
    from rigidpend.routes.codes import route_codes as route_codes
    from rigidpend.routes.symbolic import FoundOrbit as FoundOrbit
    from rigidpend.routes.symbolic import address_of as address_of
    from rigidpend.routes.symbolic import find_orbit as find_orbit

__version__ = "0.3.0.dev0"
_NAMES = {
    "mechanics.body": ("Body",),
    "notebook": ("StoredResult", "load", "orbit", "plot", "run", "theory"),
    "orbits.return_map": ("return_map",),
    "routes.certified.codes": ("CertifiedCodes", "certify_codes"),
    "routes.codes": ("RouteCodes", "route_codes"),
    "routes.symbolic": ("FoundOrbit", "address_of", "find_orbit"),
}
"""Public names, by the module that each comes from."""
_HOME = {name: module for module, names in _NAMES.items() for name in names}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that the command line starts without numpy."""
    if name not in _HOME:
        raise AttributeError(f"module 'rigidpend' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"rigidpend.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
