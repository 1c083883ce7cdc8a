"""Asymptotic surfaces (stable, unstable manifolds) of several bodies: Fig. 3 and Table 1."""
