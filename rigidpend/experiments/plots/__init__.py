"""Parts that drawings share: colours, titles, arrays of symbols as cells, planes, ticks.

Modules
-------
palette           colours and the width of a page
panels            titles of panels, entries of legends
code_arrays       arrays of symbols as cells
code_planes       planes of orbits, and where their symbols change
separatrix_ticks  ticks of a theta1 axis at the separatrices
"""
