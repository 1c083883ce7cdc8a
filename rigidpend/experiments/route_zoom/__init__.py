"""Magnifications of Fig. 4 about a change of a symbol."""
