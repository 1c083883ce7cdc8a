"""Perturbed herpolhodes along published routes: Fig. 5."""
