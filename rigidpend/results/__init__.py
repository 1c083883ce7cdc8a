"""Results: HDF5 files of named arrays, opened as data and never as more.

Modules
-------
store      results in HDF5, written whole or not at all, read in one way as declared
structure  what a file is made of, held against the layout before a value is read
damage     damage noticed, and files tried in a process of its own
"""
