"""Results: HDF5 files of named arrays, opened as data and never as more.

Modules
-------
store      results in HDF5, written completely or not at all, read in one way
structure  the structure of a file, checked against the layout before a value is read
damage     detection of damage, and trial reading in a separate process
"""
