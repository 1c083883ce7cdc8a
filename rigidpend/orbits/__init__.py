"""Orbits followed, in any precision.

Packages
--------
integrate   step by step: Taylor series in machine code, in integers; other engines beside them
return_map  from section to section, without integration: a normal form and tables
"""
