"""The config of `experiment: asymptotic_surfaces`: S1- and S2+ of several bodies (Fig. 3)."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from rigidpend.config.schema import (
    DoubleNumerics,
    ExperimentConfig,
    Moments,
    Number,
    Part,
    PhaseGrid,
    Weight,
    Word,
    holding,
    word_for_none,
)

MOST_ORBITS = 10_000
"""Largest number of orbits on a surface; memory holds all points of their curves."""


WIDE = holding(lambda x: 1 < x <= 100, "half_width must be more than 1 and at most 100")


def _few(grid: PhaseGrid) -> PhaseGrid:
    if grid.count > MOST_ORBITS:
        raise ValueError(f"at most {MOST_ORBITS} orbits on each surface, got {grid.count}")
    # These orbits are computed in doubles only, which must tell the phases apart.
    grid.apart(53)
    return grid


class Problem(Part):
    """Orbits of each body, from theta1_0 = alpha0 + beta0, J1_0 and J3 = 0."""

    bodies: Annotated[dict[Word, Moments], Field(min_length=1)]
    """Principal moments of inertia of each body, A1 > A3 > A2 and A2 + A3 >= A1; physical units."""
    beta0: Annotated[Number | None, *word_for_none("gamma0")]
    """Angle of the centre of gravity, radians; gamma0 is each body's own (Grioli)."""
    mu: Weight
    """Weight times the distance of the centre of gravity, mu >= 1e-12 h0; physical units."""
    M_0: Number
    """Initial \\|M\\|, physical; h0 = M_0^2/(2 A3)."""
    J1_0: Number
    """Initial action, dimensionless, 0 < J1_0 < J2_0/2000."""
    theta2_0: Annotated[PhaseGrid, AfterValidator(_few)]
    """Initial phases theta2_0, radians."""
    half_width: Annotated[Number, WIDE]
    """Half width of the window around alpha0 + beta0, in Delta_1, dimensionless."""

    @model_validator(mode="after")
    def _physics(self) -> Problem:
        from rigidpend.surfaces.curves import surface_problem

        for A in self.bodies.values():
            surface_problem(A, self.beta0, self.mu, self.M_0, self.J1_0)
        return self


class Config(ExperimentConfig):
    problem: Problem
    numerics: DoubleNumerics = DoubleNumerics()
