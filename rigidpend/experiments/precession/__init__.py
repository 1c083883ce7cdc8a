"""Increments of theta3 along the separatrices: full dynamics beside the first order."""
