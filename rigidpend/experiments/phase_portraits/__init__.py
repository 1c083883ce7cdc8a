"""Phase portraits of the free body, on the sphere and in the plane: Fig. 1."""

from __future__ import annotations

from functools import partial

import numpy as np

from rigidpend.experiments.compare import ROUNDING, where
from rigidpend.experiments.data import FLAG, FLOAT, WHOLE, Field, Layout, held

# On the outline rounding decides what is visible.
_OFF_OUTLINE = where(lambda stored, fresh: np.abs(stored["projected"][2]) > ROUNDING)


def _curves(name: str) -> dict[str, Field]:
    """Curves on the sphere and in the plane, with dimensions of their own."""
    points = f"points of {name}"
    on_sphere, in_plane, of_curve = (
        partial(Field, FLOAT, dimensions) for dimensions in ((3, points), (points,), (name,))
    )
    return {
        "points": on_sphere(
            "|M|", "M1, M2, M3 along the curves, one after the other, in the flow's sense"
        ),
        "offsets": Field(
            WHOLE, (f"{name}+1",), "1", "curve k has the points offsets[k] to offsets[k + 1]"
        ),
        "projected": on_sphere("|M|", "points to the right, upwards and towards the viewer"),
        "visible": Field(
            FLAG,
            (points,),
            "1",
            "whether the point is on the viewer's side of the sphere",
            within=_OFF_OUTLINE,
        ),
        "theta1": in_plane("rad", "theta1 of the points, in the window"),
        "J1": in_plane("J2", "J1/J2 of the points"),
        "arrows": Field(
            WHOLE, (f"arrows of {name}",), "1", "points at which the sense of the flow is shown"
        ),
        "energy": of_curve("J2^2", "H of each curve at mu = 0, J3 = 0, dimensionless"),
        "level": of_curve("J2^2", "J1 (J2 - J1) [cos(theta1 - beta0) - cos(alpha0)] of each curve"),
    }


_TIPS = "projected, then the axes M1, M2, M3"
_SAID = "of the vertical segments; the last is the first again, 4 pi further"
_on_sphere = partial(Field, FLOAT, units="|M|")
GROUPS = {
    "orbits": {
        **_curves("orbits"),
        "height": _on_sphere(("orbits",), description="largest |M3| of each orbit"),
        "around": Field(WHOLE, ("orbits",), "1", "axis that the orbit encircles, 1 or 2"),
    },
    "separatrices": {
        **_curves("separatrices"),
        "number": Field(WHOLE, ("separatrices",), "1", "of each separatrix, 1..4"),
    },
    "centres": _curves("centres"),
    "sphere": {
        "outline": _on_sphere(
            (2, "outline"), description="the sphere's outline, to the right and upwards"
        ),
        "axis_feet": _on_sphere((3, 3), description=f"where the axes leave the sphere: {_TIPS}"),
        "axis_tips": _on_sphere((3, 3), description=f"where the axes are drawn to: {_TIPS}"),
    },
    "plane": {
        "window": Field(FLOAT, (2,), "rad", "theta1 from one separatrix 1 to the next"),
        "separatrix_theta1": Field(FLOAT, (5,), "rad", f"theta1 {_SAID}"),
        "separatrix": Field(WHOLE, (5,), "1", f"number {_SAID}"),
    },
}
LAYOUT: Layout = {name: held(ROUNDING, fields) for name, fields in GROUPS.items()}
