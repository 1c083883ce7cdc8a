"""Trials at the limits: each claim has a bound, declared before the run, which may refute it.

scenes     claims, their limits and verdicts; orbits, their starts and distances
roundings  errors of integrated orbits, predicted from the variational equations
passages   growth of errors in a passage; the number of symbols that a precision decides
conserved  reflection, time reversal; integrals over 1e6 rotations
extremes   bodies, energies and starts at the ends of their ranges
honesty    flags `certain` with spoilt tolerances, or spoilt tables of return maps; orbits
           found from random codes of random bodies, read back
compute, draw
           the experiment: all trials in their order, stored, printed and drawn
"""

from functools import partial

from rigidpend.experiments.data import ANY, Field, Layout, double, text, whole

PASSED, LIMIT, REFUTED = "passed", "limit", "FAILED"
"""Verdicts: within the bound; beyond it within a declared limit; beyond it."""


# Rounding errors differ from machine to machine: each is tested by its own bound instead.
_number = partial(double, gaps=True, within=ANY)
_count = partial(whole, "1", within=ANY)


def _claims(*of: str) -> dict[str, Field]:
    """Fields of the claims of a kind of trial, one after the other."""
    each = " of ".join(("claims", *of))
    told = partial(text, "text", dimensions=(each,))
    return {
        "name": told("what is claimed"),
        "measured": told("what the value is", within=ANY),
        "value": _number("see unit", "what was found", each),
        "bound": _number("see unit", "the largest value that passes", each),
        "unit": told("unit of the value and of its bounds", within=ANY),
        "reason": told("why the bound is what it is", within=ANY),
        "ratio": _number("1", "value over bound", each),
        "verdict": told("passed, limit (declared before), FAILED"),
        "limit": told("why it is known to exceed the bound, if it is", within=ANY),
        "up_to": _number("see unit", "the largest value that the limit explains", each),
        "note": told("what else is to be said of this run", within=ANY),
    }


GROWTH = {
    "crossing": _count("passages behind", "crossings"),
    "measured": _number("rad", "phase error, geometric mean", "crossings"),
    "predicted": _number("rad", "the same, predicted", "crossings"),
    "floor": _number("rad", "the last bit of a time in doubles", "crossings"),
    "scatter": _number("rad", "phase error of each orbit (n_crossings, n)", "crossings", "orbits"),
    "growth_measured": _number("1", "growth a passage"),
    "growth_predicted": _number("1", "growth a passage"),
}
"""Errors at each crossing, and their growth a passage: see `passages.growth_trial`."""
DECIDED = {
    "bits": _count("precision"),
    "measured": _count("symbols decided on each orbit", "columns"),
    "predicted": _count("the same on orbits of the prediction", "tangents"),
}
"""Symbols that a precision decides: see `passages.decided_trial`."""
DRIFT = {
    "name": text("", "what integrates"),
    "rotations": _number("1", "time in rotations without weight", "times"),
    "drift": _number("1", "rms of energy/h0, |gamma|, M.gamma/|M|: (3, k)", 3, "times"),
    "walk": _number("1", "predicted random walk of roundings", "times"),
    "power": _number("1", "fitted power of t of each", 3),
}
"""Drift of the integrals of motion: see `conserved`."""
CURVES: dict[str, Layout] = {
    "passages": {"growth?": GROWTH, "<precisions>": DECIDED},
    "long_time": {"<tolerances>": DRIFT},
}
"""Curves behind the claims, by kind of trial and label; a trial that was refused has none."""

OF_CLAIM = _claims()
LAYOUT: Layout = {
    **{f"{kind}?": {"claims": _claims(kind), "curves": x} for kind, x in CURVES.items()},
    "<kinds>": {"claims": OF_CLAIM, "curves": {}},
}
