"""Phase portraits of the free body, on the sphere and in the plane: Fig. 1."""

from functools import partial

import numpy as np

from rigidpend.experiments.compare import ROUNDING, where
from rigidpend.experiments.data import Field, double, flag, held, whole

# On the outline of the sphere rounding decides whether a point is visible.
_OFF_OUTLINE = where(lambda stored, fresh: np.abs(stored["projected"][2]) > ROUNDING)


def _curves(name: str) -> dict[str, Field]:
    """Curves on the sphere and in the plane, with dimensions of their own."""
    points = f"points of {name}"
    on_sphere, in_plane, of_curve = (
        partial(double, dimensions=sizes) for sizes in ((3, points), (points,), (name,))
    )
    return {
        "points": on_sphere(
            "|M|", "M1, M2, M3 along the curves, one after the other, in the flow's sense"
        ),
        "offsets": whole("1", "curve k has the points offsets[k] to offsets[k + 1]", f"{name}+1"),
        "projected": on_sphere("|M|", "points to the right, upwards and towards the viewer"),
        "visible": flag(
            "1",
            "whether the point is on the viewer's side of the sphere",
            points,
            within=_OFF_OUTLINE,
        ),
        "theta1": in_plane("rad", "theta1 of the points, in the window"),
        "J1": in_plane("J2", "J1/J2 of the points"),
        "arrows": whole("1", "points at which the sense of the flow is shown", f"arrows of {name}"),
        "energy": of_curve("J2^2", "H of each curve at mu = 0, J3 = 0, dimensionless"),
        "level": of_curve("J2^2", "J1 (J2 - J1) [cos(theta1 - beta0) - cos(alpha0)] of each curve"),
    }


_TIPS = "projected, then the axes M1, M2, M3"
_SAID = "of the vertical segments; the last is the first again, 4 pi further"
_on_sphere = partial(double, "|M|")
LAYOUT = held(
    ROUNDING,
    {
        "orbits": {
            **_curves("orbits"),
            "height": _on_sphere("largest |M3| of each orbit", "orbits"),
            "around": whole("1", "axis that the orbit encircles, 1 or 2", "orbits"),
        },
        "separatrices": {
            **_curves("separatrices"),
            "number": whole("1", "of each separatrix, 1..4", "separatrices"),
        },
        "centres": _curves("centres"),
        "sphere": {
            "outline": _on_sphere("the sphere's outline, to the right and upwards", 2, "outline"),
            "axis_feet": _on_sphere(f"where the axes leave the sphere: {_TIPS}", 3, 3),
            "axis_tips": _on_sphere(f"where the axes are drawn to: {_TIPS}", 3, 3),
        },
        "plane": {
            "window": double("rad", "theta1 from one separatrix 1 to the next", 2),
            "separatrix_theta1": double("rad", f"theta1 {_SAID}", 5),
            "separatrix": whole("1", f"number {_SAID}", 5),
        },
    },
)
