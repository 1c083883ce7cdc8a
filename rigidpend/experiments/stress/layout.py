"""What a result of `stress` consists of; the trials themselves say what their numbers mean."""

from __future__ import annotations

from rigidpend.results.layout import NUMBER, TEXT, Field, Layout


def _numbers(*dimensions: int | str) -> Field:
    return Field(NUMBER, dimensions, gaps=True)


CASE = {
    **dict.fromkeys(("value", "bound", "ratio"), _numbers()),
    **dict.fromkeys(("verdict", "limit"), Field(TEXT)),
}
GROWTH = {
    "crossing": _numbers("crossings"),
    **dict.fromkeys(("measured", "predicted", "floor"), _numbers("crossings")),
    "scatter": _numbers("crossings", "orbits"),
    **dict.fromkeys(("growth_measured", "growth_predicted", "growth_whisker"), _numbers()),
}
DECIDED = {
    **dict.fromkeys(("bits", "asked"), _numbers()),
    "measured": _numbers("columns"),
    "predicted": _numbers("tangents"),
}
HONESTY = {
    "tolerance": _numbers("tolerances"),
    **dict.fromkeys(("symbols", "wrong", "lies"), _numbers("tolerances")),
}
PENDULUM = dict.fromkeys(("rotations", "phase", "walk"), _numbers("periods"))
DRIFT = {
    "name": Field(TEXT),
    **dict.fromkeys(("rotations", "walk"), _numbers("times")),
    "drift": _numbers(3, "times"),
    "power": _numbers(3),
}
CURVES: dict[str, Layout] = {
    "passages": {"growth": GROWTH, "<precisions>": DECIDED},
    "honesty": {"<starts>": HONESTY},
    "long_time": {"pendulum": PENDULUM, "<methods>": DRIFT},
}
"""The curves behind the cases, of the kinds of trials that have such."""

LAYOUT: Layout = {
    **{
        f"{kind}?": {"cases": {f"<cases of {kind}>": CASE}, "curves": curves}
        for kind, curves in CURVES.items()
    },
    "<kinds>": {"cases": {"<cases>": CASE}, "curves": {}},
}
