"""Benchmark: speed, error and trust of rigidpend beside other methods, each at its best.

methods    methods as data: the settings tried for each, and the choice among them
problems   orbits of Fig. 4 and of randomly drawn bodies; their truth, and errors of answers; the
           equations as methods integrate them
peers, cyrk_compiled
           methods made ready for a task
measure    the measurements of a worker: search, meeting, counts of symbols, times of orbits
compute, report, draw
           the experiment: the order of measurements, their storage, tables and figure

Measured earlier and left out. Peers: diffrax (JAX), 150 times our time at Fig. 4; SciPy's
LSODA and Radau, SUNDIALS' CVODE through scikit-sundae and REBOUND's Bulirsch-Stoer, 190 to 17,000
times; CyRK's LSODA, never its best; heyoka's ensemble, its compact mode, its integrator of one
orbit and the equations (eq1), slower than its batches on Euler-Poisson. Problems, and the fastest
peer's time in units of ours: the free body carried to a time (1.1, heyoka on (eq1)), the pendulum
motion (5:3) (18.7), alpha(T) of Fig. 5 (1.62). Two threads at Fig. 4, which serve CyRK alone and
make it twice as fast. Our own 64, 106 and 113 bits, 145, 13 and 3,600 times our doubles.
Lie-Poisson splittings of order 2 to 8, 289 and 831 times ours, at larger errors.

Looked at and left out: numbalsoda, extensisq, pyodesys, pycvodes, sundials4py, scikits.odes and
Assimulo have no wheel for Linux and Python 3.11; JiTCODE compiles with the system's C compiler and
has no events; torchdiffeq and torchode bring PyTorch; numbakit-ode offers DOP853, as CyRK does;
desolver steps in plain Python; nodepy is not meant to be fast; CasADi calls CVODE.
"""

from typing import Any

from rigidpend.experiments.data import ANY, Field, Layout, double, text


def _floats(meaning: dict[str, str], *dimensions: str, gaps: bool = True) -> dict[str, Field]:
    """Fields of measured numbers, from texts "unit, meaning"; they are not compared."""
    told = ((name, *said.partition(", ")) for name, said in meaning.items())
    how: Any = {"gaps": gaps, "within": ANY}
    return {name: double(unit, about, *dimensions, **how) for name, unit, _, about in told}


TRUST = {
    "wrong_trusted": "1, wrong symbols that the method vouches for; all where it vouches for none",
    "undecided": "1, symbols that it does not vouch for",
}
HOW = "how the measurement ended: complete, cut where it took too long, or why not"
ENDED = text("text", HOW, within=ANY)
ANSWERED = {
    "error?": "1, of the crossing times, t': the median over the columns of the largest one",
    "wrong_symbols?": "1, number of wrong symbols",
}
"""Units and meanings of the numbers on an answer at Fig. 4."""
SEARCH = {
    "tolerance?": "1, local tolerance; NaN where there is none to choose",
    "setting?": "1, index of the variant, in the order of `variants`",
    "seconds?": "s, warm, the median",
}
SEARCHED: Layout = {"ended": ENDED, **_floats({**SEARCH, **ANSWERED}, "measurements")}
"""Record of a method's search; numbers that it did not measure are absent."""
MET: Layout = {
    **_floats(ANSWERED),
    **_floats({"rounds": "s, each round of the meeting; NaN: not timed"}, "rounds"),
}
"""Record of a method at the meeting."""
COUNTED = _floats(
    {
        "orbits": "1, random phases that were tried",
        "symbols": "1, symbols compared with 113-bit arithmetic",
        "seconds": "s, warm, one thread, for all these orbits",
        **TRUST,
    }
)
"""Record of a method on random phases."""
OF_BODIES = _floats(
    {
        "orbits": "1, orbits of each body, from random phases",
        "first": "s, first call with a body: made ready and solved, for all these orbits",
        "again": "s, the same call again, the median",
        "symbols": "1, symbols compared: of orbits before the first that is in doubt",
        **TRUST,
    },
    "bodies",
    gaps=False,
)
"""Record of a method with randomly drawn bodies."""
BODY = _floats(
    {
        **{f"A{i}": f", principal moment A{i}" for i in (1, 2, 3)},
        **{f"r{i}": f"1, centre of gravity, unit vector, axis {i}" for i in (1, 2)},
        "mu": ", weight times distance",
        "h0": ", energy constant",
        "J1_0": "1, initial action, dimensionless",
    },
    "bodies",
    gaps=False,
)
"""The bodies themselves."""

LAYOUT: Layout = {
    "fig4": {"<methods>": SEARCHED},
    "meeting": {"ended": ENDED, "<methods that met>": MET},
    "random_phases": {"<starts>": {"<methods counted>": COUNTED}},
    "bodies?": {**BODY, "ended": ENDED, "<methods with bodies>": OF_BODIES},
}
