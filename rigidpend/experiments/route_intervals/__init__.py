"""Intervals of initial phases: on each the first symbols of all orbits are proven the same."""
