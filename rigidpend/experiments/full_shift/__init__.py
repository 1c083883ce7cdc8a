"""Closed orbits by their codes, with multipliers and actions."""
