"""Numbers taken exactly as they are written.

Modules
-------
exact        rational numbers and pi, kept exact; functions of them in any precision
expressions  texts such as 3*pi/40, read for any kind of number; numbers and codes as texts
checked      arguments of functions, taken or refused in a sentence
generic      types of numbers of any kind, and of their functions
"""
