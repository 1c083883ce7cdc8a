"""Splitting of the asymptotic surfaces: full dynamics beside Melnikov's integral."""
