"""The return map: orbits and their route codes without integrating them.

Between two crossings of M3 = 0 an orbit only passes a hyperbolic periodic orbit, and there its
motion has a normal form. So the map from crossing to crossing (the return map, a separatrix
map exact to rounding) is a table, a logarithm and another table.

Parts
-----
precision     numbers of any precision in arrays
expansions    Fourier and Chebyshev expansions
jets          power series in two variables
reduced       the reduced equations beside the upper periodic orbit
nome          the invariant in which the normal form's series shrink best
normal_form   Moser's normal form, found degree by degree
conjugacy     the normal form at given energies, evaluated and inverted
poincare      the section M3 = 0 in coordinates (d, chi)
midline       curves on it midway between both surfaces, from which d counts
tables        functions of a place, a phase and the energy: fitted at nodes, and looked up
charts        from the section to the normal form and back, as tables
passage       passages, forward and backward, with their derivatives, and first crossings
program       a finished map, and starts in the normal form, as data for the kernel
kernel        many orbits followed through any map, in machine code
kernel_sums   tables and polynomials summed in lanes: parts of the kernel
looks         two looks at a body: how wide its layer of orbits is, how fast its series shrink
orders        sizes of the tables, from these looks
checks        errors at held-out points
build         maps built and checked, or refused
storage       maps on request: from memory, from disk, or built
"""

from __future__ import annotations

from rigidpend.orbits.return_map.build import ReturnMap
from rigidpend.orbits.return_map.normal_form import MapError
from rigidpend.orbits.return_map.passage import EnergyLevel, Passage, SectionPoint
from rigidpend.orbits.return_map.storage import return_map

__all__ = ["EnergyLevel", "MapError", "Passage", "ReturnMap", "SectionPoint", "return_map"]
