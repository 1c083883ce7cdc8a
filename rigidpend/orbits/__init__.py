"""Orbits followed, in any precision.

Packages
--------
integrate   step by step, by Taylor series in machine code or in integers, or by DOP853
return_map  from section to section, without integration, by a normal form and tables
records     records of arrays with a column for each orbit: to select, join or replace columns
"""

M_UNITS = "1", "1.37", "0.61"
"""Units of M of independent computations of an orbit, so that no two share their roundings."""
