"""Orbits followed, in any precision.

Packages
--------
integrate   step by step: Taylor series in machine code, in integers; other engines beside them
return_map  from section to section, without integration: a normal form and tables
records     arrays with a column for each orbit: some of them, joined, replaced
"""

UNITS = "1", "1.37", "0.61"
"""Units of M of independent computations of an orbit: they share no rounding."""
