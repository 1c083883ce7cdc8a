"""The config of `experiment: full_shift`: a proof that every code occurs."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rigidpend.config.bodies import HeavyBody
from rigidpend.config.schema import Auto, ExperimentConfig, Number, Whole
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import check_energy


class Problem(HeavyBody):
    """A heavy body and the energy at which every code is to be proven to occur."""

    h: Auto[Number] = None
    """Energy of all orbits (eq. h0_new), h > mu > 0; physical units, as mu; given unless h0 is."""
    h0: Auto[Number] = None
    """Energy constant kappa J2_0^2/2 of Fig. 4's own line, physical units, in the place of h."""
    J1_0: Number
    """Initial action of a line of starts, dimensionless, a decimal or fraction, J1_0 > 0."""
    half_turns: Auto[Annotated[Whole, Field(ge=1, le=100)]] = None
    """Half rotations of every passage; with more, sets are smaller. Searched unless given."""
    lengths: Annotated[Whole, Field(ge=1, le=4)] = 1
    """Number of sets of each symbol: with half_turns half rotations, with 2 more, and so on."""
    approach: Auto[str] = None
    """Address of an orbit of h0 whose last crossing lies between the sets: starts come along it."""
    around: Number = exact(0)
    """Share by which h may differ, dimensionless: one proof holds for all these energies."""

    @model_validator(mode="after")
    def _rotates(self) -> Self:
        if not float(self.mu) > 0:
            raise ParameterError("mu", "without a weight no orbit leaves a surface: mu > 0")
        name, level = ("h", self.h) if self.h is not None else ("h0", self.h0)
        if level is None or (self.h is not None and self.h0 is not None):
            raise ParameterError("h", "give either h or h0")
        check_energy(name, level, self.mu)
        if self.h0 is not None and float(self.around):
            raise ParameterError(
                "around", "give it with h, not with h0: there the energies are those of the line"
            )
        if self.approach is not None:
            if self.h0 is None:
                raise ParameterError(
                    "approach", "an approach needs h0: it belongs to starts with one h0"
                )
            from rigidpend.routes.symbolic.address import parsed

            try:
                parsed(self.approach)
            except ParameterError as error:
                raise ParameterError("approach", str(error)) from None
        if not 0 <= float(self.around) < 0.1:
            said = f"expected a number from 0 to less than 0.1, got {self.around}"
            raise ParameterError("around", said)
        if self.J1_0.fraction is None or not 0 < float(self.J1_0) < 1e-3:
            said = f"expected a decimal or fraction between 0 and 0.001, got {self.J1_0}"
            raise ParameterError("J1_0", said)
        return self


class Config(ExperimentConfig):
    problem: Problem
