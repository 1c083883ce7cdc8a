"""Results: trees of named arrays in HDF5 files, their safety and their comparison.

Modules
-------
tree        the data of a result: named arrays with their meaning, in groups
layout      what an experiment's results consist of, declared as plain data
store       results in HDF5, written whole or not at all, read as declared
opening     the one way to open a result file, whoever made it
structure   what a file is made of, held against the layout before a value is read
content     what a file says, checked before it is used
words       words from a file, fit for a message
files       files replaced in one step and sealed with a digest
kept        files of what can be made again, each with what it is of
cache       the user's folder of such files: compiled code, return maps
damage      damage noticed, and files tried in a process of its own
locks       folders and files held together with other runs
compare     differences of two results, by value
regression  results against stored references
"""
