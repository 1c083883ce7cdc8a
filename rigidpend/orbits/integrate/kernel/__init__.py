"""Machine code of our own: Taylor steps of many orbits, and what return maps need.

`taylor_step` writes a step in the language of LLVM, in doubles or in sums of doubles
(`lane_numbers`, with the sine, cosine and logarithm that return maps need), of a field that is
taken down on a `tape`. `following` has the two kernels: crossings of M3 = 0, and states at given
times. `machine_code` writes, compiles, keeps and loads them all.
"""
