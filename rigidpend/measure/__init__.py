"""Measurements of the program itself, which take minutes and depend on the machine.

Packages
--------
benchmark  run time against error, beside other programs
stress     trials at the limits, each with a stated bound
"""
