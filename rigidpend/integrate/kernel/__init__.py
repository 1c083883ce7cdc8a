"""Kernel of the engine `taylor`: Taylor steps of many orbits in machine code of our own.

`steps` writes the field's recurrences in the language of LLVM (`writer`), in doubles or in pairs
of doubles (`lane_numbers`); `machine_code` compiles, keeps and loads them.
"""
