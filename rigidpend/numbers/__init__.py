"""Numbers taken exactly as they are written.

Modules
-------
exact        exact numbers: rationals, pi, texts such as 3*pi/40, and functions of them
expressions  numbers, codes and values as texts
checked      checks of arguments, which are taken exactly or refused in a sentence
generic      types for functions of any kind of number
"""
