"""Compiled kernels: Taylor steps of many orbits, and the arithmetic that return maps need.

Modules
-------
tape            traces a field: the list of its operations
lane_numbers    doubles and sums of doubles in vectors of lanes
lane_functions  sine, cosine and logarithm of them
taylor_step     writes a Taylor step of a traced field in LLVM's language
following       the two kernels that follow orbits: to crossings of M3 = 0, and to given times
sum_loops       loops over arrays of sums of doubles
machine_code    writes LLVM's language, compiles it, keeps and loads the code
"""
