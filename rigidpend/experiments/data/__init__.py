"""Data of results: named arrays in groups, how they are declared, and how two are compared.

Modules
-------
tree     named arrays with their meaning, in groups
layout   what an experiment's results consist of, declared as plain data
compare  differences of two results, by value
"""
