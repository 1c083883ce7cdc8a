"""Numbers taken exactly as they are written.

Modules
-------
exact        rational numbers and pi, kept exact; functions of them in any precision
expressions  numbers read from texts such as 3*pi/40
parameters   the error of a parameter that its conditions exclude
"""
