"""Trials at the limits, each with a bound declared before."""
