"""Data of results: named arrays in groups, how they are declared, and how two are compared.

Modules
-------
tree     named arrays with their meaning, in groups
layout   what an experiment's results consist of, with unit, meaning and bound
compare  differences of two results, by value
bounds   by how much a field may differ, where one number does not say it
"""
