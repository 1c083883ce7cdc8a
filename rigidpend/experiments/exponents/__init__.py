"""Finite-time Lyapunov exponents over a plane of initial phase and action."""
