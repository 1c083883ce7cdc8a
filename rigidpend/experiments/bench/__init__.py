"""Benchmark: speed, error and trust of rigidpend beside other methods, each at its best."""
