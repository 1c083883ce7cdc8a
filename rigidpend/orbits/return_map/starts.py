"""Starts of orbits beside the lower periodic orbit, put into the normal form as a table."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.pair_arrays import PairArray
from rigidpend.orbits.return_map.charts import INVERSE, ChartTable, fitted
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm
from rigidpend.orbits.return_map.precision import Precision

MOST_NODES = 20
"""Chebyshev nodes in Qp from which on a start counts as outside of the normal form."""

ROUNDINGS = 8
"""Roundings in a coefficient of the table of starts; relative, for the largest is of order 1."""


class Entry(NamedTuple):
    """Starts at Qm = 0 put into the normal form, as a table."""

    centre: Any
    half_width: Any
    """Half of the interval of Qp; 0 where it is a point."""
    table: ChartTable
    """v/Qp, u/Qp and tau over (x, psi), x = (Qp - centre)/half_width."""

    def place(self, Qp: Scalar) -> Any:
        """x of starts, in their numbers: doubles or pairs of them."""
        if not self.half_width:
            return 0 * Qp
        centre, half_width = (z if isinstance(Qp, PairArray) else float(z) for z in self[:2])
        x = (Qp - centre) * (1 / half_width)
        return np.where(x > 1, 1.0, np.where(x < -1, -1.0, x))


def entry(nf: NormalForm, least: Scalar, most: Scalar, a: Precision) -> Entry:
    """Starts at Qp from `least` to `most`, numbers of the precision.

    Raises
    ------
    MapError
        The normal form does not reach as far as `most`.
    """
    centre, half_width = (least + most) / 2, (most - least) / 2

    def placed(x: Any, psi: Any, form: TorusForm) -> Any:
        Qp = centre + half_width * x
        at = form.inverted(psi, Qp, 0 * Qp)
        return np.stack((at.v / Qp, at.u / Qp, at.tau))

    for n_x in range(6, MOST_NODES, 3) if half_width else (1,):
        table = fitted(placed, a.number(1), n_x, nf.n, nf, INVERSE, a)
        last = table.values.reshape(nf.energies.n, n_x, nf.n, -1)[:, -2:]
        if n_x == 1 or a.largest(last) <= ROUNDINGS * a.epsilon:
            return Entry(centre, half_width, table)
    raise MapError("the start lies outside of the range of the normal form")
