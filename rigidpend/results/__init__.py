"""Results: trees of named arrays in HDF5 files, their safety and their comparison.

Modules
-------
tree        the data of a result: named arrays with their meaning, in groups
store       results in HDF5, written whole or not at all
files       files replaced in one step and sealed with a digest
damage      which files are safe to open
locks       folders and files held together with other runs
compare     differences of two results, by value
regression  results against stored references
"""
