"""The return map: orbits and their route codes without integrating them.

Between two crossings of M3 = 0 an orbit only passes a hyperbolic periodic orbit, and there its
motion has a normal form. So the map from crossing to crossing (the return map, a separatrix
map exact to rounding) is a table, a logarithm and another table.

The map comes about in this way
-------------------------------
1. The upper periodic orbit, J1 = J2, is hyperbolic. At a given energy, with J3 = 0 and the angle
   psi as time, the motion beside it has two dimensions, Qp and Qm (`reduced`). Moser's normal form
   gives both as series in u and v, for which du/dpsi = Lambda(I) u and dv/dpsi = -Lambda(I) v with
   I = u v. So an orbit comes along v, leaves along u and keeps I, and the angle psi that it takes
   is a logarithm over Lambda (`normal_form`, by the power series of `jets`).
2. Points of the section M3 = 0 have a coordinate d, small beside the surfaces, and a phase chi
   (`poincare`). Short arcs lead from them to where the normal form holds, and there it is solved
   for u and v (`conjugacy`). What does not depend on where an arc ends is kept as a function of d
   and chi: U, V, and constants of time and theta3. That is a chart; its inverse goes the other way.
   Downward and upward crossings have one of each (`charts`).
3. A chart is a table: coefficients of Chebyshev polynomials of d (or I) and of the energy, and of
   harmonics of chi, from values at nodes (`tables`, `expansions`).
4. A passage is a chart, the logarithm, and the inverse chart of the other section (`passage`). The
   lower orbit is passed by the same tables, mirrored. For many orbits the terms that count are
   copied to arrays, a `program`, through which machine code leads them side by side (`kernel`).

A request (`storage.return_map`) for a body, an interval of energies, a number of bits and a
`Design` finds a kept map or has one built. `build` first asks how large tables must be, and then
makes them:

===========  =======================================================================================
look         at the surfaces, roughly: how wide the layer of orbits is, |d| and |I| (`Layer`)
look again   at one energy over this layer: how fast series shrink with each order (`Shrinking`)
orders       from both, and from the bits: the degree, the numbers of nodes, the arcs' duration
cost         seconds that this takes; over its budget a map is refused (`Costly`)
attempt      the normal form and both charts with their inverses, in the precision of tables
errors       measured at held-out points; too large ones raise the orders for another attempt
round        all tables to the map's own bits
===========  =======================================================================================

Bodies for which no step can be trusted are refused with a reason, a `MapError`.

Layers
------
Orbits of interest stay within a few splittings of the surfaces. Mostly the layer holds the whole
displacement of both surfaces, and d counts from 0. If series shrink too slowly over it, thinner
layers are tried, which some orbits leave. Where a body turns fast (large nu), weight displaces both
surfaces together by far more than it splits them: the request says by how many bits the layer is
`narrower`, and d counts from the midline between the surfaces (`midline`).

Precisions
----------
========  ==========================================================================================
a map     53 bits in doubles, up to 96 in pairs of doubles, more in mpmath's numbers
tables    6 bits more than the map while pairs hold them: before their numbers are rounded
arcs      as tables; beside a midline more, by what d loses with it: pairs, or sums of three doubles
programs  doubles, or pairs of doubles with terms in doubles wherever these have digits enough
========  ==========================================================================================

A map in doubles, or one whose tables have no more bits than its own, may err by some thousand
roundings; all others by one at most. A search (`conjugacy`, `charts`) runs in doubles up to its
last corrections, which are made in the full precision.

Parts
-----
expansions    Fourier and Chebyshev expansions
jets          power series in two variables
reduced       the reduced equations beside the upper periodic orbit
nome          the invariant in which the normal form's series shrink best
normal_form   Moser's normal form, found degree by degree
conjugacy     the normal form at given energies, evaluated and inverted
poincare      the section M3 = 0 in coordinates (d, chi)
midline       curves on it midway between both surfaces, and the layer of orbits beside them
tables        functions of a place, a phase and the energy: fitted at nodes, and looked up
charts        from the section to the normal form and back, as tables
passage       passages, forward and backward, with their derivatives, and first crossings
program       a finished map, and starts in the normal form, as data for the kernel
kernel        many orbits followed through any map, in machine code
kernel_sums   tables and polynomials summed in lanes: parts of the kernel
looks         two looks at a body: how wide its layer of orbits is, how fast its series shrink
orders        sizes of the tables, from these looks
checks        errors at held-out points
build         maps built to a plan and to a design, or refused
storage       maps on request: from memory, from disk, or built
"""

from rigidpend.orbits.return_map.build import ReturnMap
from rigidpend.orbits.return_map.normal_form import MapError
from rigidpend.orbits.return_map.passage import EnergyLevel, Passage, SectionPoint
from rigidpend.orbits.return_map.storage import return_map

__all__ = ["EnergyLevel", "MapError", "Passage", "ReturnMap", "SectionPoint", "return_map"]
