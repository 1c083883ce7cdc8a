"""Results: HDF5 files of named arrays, opened as data and never as more."""
