"""Binary route codes: the sides on which an orbit leaves the periodic orbits that it passes.

`codes` is the way in; `problem` and `phases` hold what is asked, `start` where the orbits
begin, `certainty` what makes a symbol certain, `cycle` the graph of Fig. 2 and its symbols.
`mapped` finds routes by return maps, `neighbourhood` those of phases close together beside one
reference orbit, `change` the phase at which a symbol changes. `plane` finds those over a plane of
theta2_0 and J1_0, `bodies` those of orbits of several bodies and energies.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidpend.routes.codes import RouteCodes as RouteCodes
    from rigidpend.routes.codes import route_codes as route_codes
    from rigidpend.routes.problem import ProblemError as ProblemError
    from rigidpend.routes.problem import RouteProblem as RouteProblem

__all__ = ["ProblemError", "RouteCodes", "RouteProblem", "route_codes"]


def __getattr__(name: str) -> Any:
    """Import a name when it is first used: drawing needs modules of this folder, and no codes."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = "problem" if name in ("ProblemError", "RouteProblem") else "codes"
    return getattr(import_module(f"{__name__}.{home}"), name)
