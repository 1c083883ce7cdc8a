"""Numbers taken exactly as they are written.

Modules
-------
exact        rational numbers and pi, kept exact; texts such as 3*pi/40, and functions of them
expressions  numbers, codes and values as texts
checked      arguments of functions, taken or refused in a sentence
generic      types of numbers of any kind, and of their functions
"""
