"""Benchmark: speed, error and trust of rigidpend beside other methods, each at its best.

Here is the layout of a result: what it consists of, with unit and bound.

methods    problems and methods as data: what is tried for each, and which setting is chosen
problems   the task of each problem, its truth and its error; bodies drawn by lot
solvers    a method made ready for a task; the equations as methods integrate them
ours, peers, cyrk_compiled
           the adapters: ``answered(task, knob, threads, **setting)``
measure    what a worker measures: search, meeting, symbols counted and orbits timed
compute, layout, report, draw
           the experiment: what is measured in which order, stored, told and drawn

Peers
-----
heyoka in batches of 4 to 16 lanes, on Euler-Poisson and (eq1); CyRK (DOP853, Verner 8, LSODA) with
rates compiled by numba; diffrax (Dopri8, Tsit5), jitted and vmapped; SciPy's DOP853, all orbits
as one system.

Measured before, and left out since: SciPy's LSODA and Radau, SUNDIALS' CVODE through scikit-sundae
and REBOUND's Bulirsch-Stoer took 190 to 17,000 times our time at every problem; heyoka's ensemble,
its compact mode and its integrator of one orbit more than its batches; our own 64 and 113 bits
145 and 3,600 times our doubles.

Looked at and left out: numbalsoda, extensisq, pyodesys, pycvodes, sundials4py, scikits.odes and
Assimulo have no wheel for Linux and Python 3.11 (CyRK serves numbalsoda's LSODA and DOP853);
JiTCODE compiles with the system's C compiler and has no events; torchdiffeq and torchode bring
PyTorch, which weighs more than all others together, for the methods that diffrax has; numbakit-ode
has had no release since 2022 and offers DOP853, as CyRK does; desolver steps in plain Python;
nodepy analyses methods and does not mean to be fast; CasADi calls CVODE.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping

from rigidpend.experiments.compare import Difference
from rigidpend.experiments.data import ANY, FLOAT, TEXT, Bound, Data, Field, Fields, Layout

SAME, CHAOTIC = 30, 1e-3
"""Allowed factor between errors: where rounding rules, and where chaos magnifies it."""


def _errors(name: str, stored: Data, fresh: Data) -> list[Difference]:
    """Errors agree but for rounding, setting by setting; what one run alone measured is passed."""
    found, at = [], {_key(fresh, k): k for k in range(len(fresh["knob"]))}
    for i, old in enumerate(stored[name]):
        k, knob = at.get(_key(stored, i)), f"at {stored['knob'][i]:g}"
        if k is None or not old < CHAOTIC or stored["part"][i] != fresh["part"][k]:
            continue
        most = SAME * max(old, sys.float_info.epsilon)
        if not fresh[name][k] <= most:
            found.append(Difference(f"{name} {knob}", old, fresh[name][k], most))
        if "wrong_symbols" in stored:
            before, wrong = stored["wrong_symbols"][i], fresh["wrong_symbols"][k]
            if wrong > before:
                found.append(Difference(f"wrong_symbols {knob}", before, wrong))
    return found


def _key(record: Data, k: int) -> str:
    return f"{record['knob'][k]:.6g} {record['setting'][k]:g}"


def _floats(
    meaning: Mapping[str, tuple[str, str]], *dimensions: str, gaps: bool = True
) -> dict[str, Field]:
    """Times are never compared, and errors only of the search; the rest tells how, not what."""
    return {name: Field(FLOAT, dimensions, *said, gaps, ANY) for name, said in meaning.items()}


def _if_there(fields: Fields) -> dict[str, Field]:
    return {f"{name}?": field for name, field in fields.items()}


MEASURED = {
    "knob": ("1", "tolerance, or steps in a period; NaN where there is none"),
    "setting": ("1", "index of the variant, in the order of `variants`"),
    "error": ("1", "of the answer, as the problem defines it"),
    "worst": ("t' = t s", "largest error of a crossing time, over the columns"),
    "wrong": ("1", "share of wrong symbols"),
    "wrong_symbols": ("1", "number of wrong symbols"),
    "wrong_trusted": ("1", "number of wrong symbols that the method vouches for"),
    "undecided": ("1", "number of symbols that it does not vouch for"),
    "energy": ("1", "largest drift of the energy, relative"),
    "gamma": ("1", "largest drift of |gamma|, relative"),
    "area": ("1", "largest drift of M . gamma, in |M|"),
    "part": ("1", "how far the orbits were followed, of the whole way"),
    "orbits": ("1", "orbits that were measured; the time is scaled to all of the problem's"),
    "seconds": ("s", "warm, the median, scaled to the whole problem"),
    "once": ("s", "the same, of what was solved"),
    "repeats": ("1", "how many repetitions the median is of"),
    "prepare": ("s", "made ready and solved first, beyond a warm solve: compilation, mostly"),
    "memory": ("MB", "peak of the process so far"),
    "threads": ("1", "of those allowed at the meeting, as many as took it least time"),
}
"""Units and meaning of what is measured of a method at a problem, with one setting."""
ENDED = Field(
    TEXT, (), "text", "how the measurement ended: complete, cut at the budget, or why not"
)
CHOSEN = Field(TEXT, (), "text", "the setting that the search chose", within=ANY)

ROWS = _floats(MEASURED, "measurements")
ROWS["error"] = ROWS["error"]._replace(within=Bound(_errors, sized=False))
ONCE = {
    **_floats(
        {
            "import": ("s", "time to import its libraries, NumPy apart"),
            "memory_before": ("MB", "peak of the process before that import"),
            "form": ("1", "index of the form that was chosen"),
        }
    ),
    "forms": Field(TEXT, (), "text", "what each form took at the middle knob", within=ANY),
}
SEARCHED: Layout = {"ended": ENDED, **_if_there(ONCE), **_if_there(ROWS)}
"""Record of a method's search at a problem; what it did not measure is absent."""
ROUND = _floats(
    {"rounds": ("s", "each round of the meeting, scaled to the whole problem; NaN: not timed")},
    "rounds",
)
ONE_SETTING = _floats(MEASURED)
MET: Layout = {**_if_there(ONE_SETTING), **ROUND, "chosen": CHOSEN}
"""Record of a method at a meeting, with the setting that was chosen for it."""
COUNTED = _floats(
    {
        "orbits": ("1", "random phases that were tried"),
        "symbols": ("1", "symbols compared with 113-bit arithmetic"),
        "wrong": ("1", "of them wrong"),
        "wrong_trusted": (
            "1",
            "of them wrong and vouched for; without a cross-check, all wrong ones",
        ),
        "undecided": ("1", "of them not vouched for"),
        "seconds": ("s", "warm, one thread, for all these orbits"),
        "last_crossing": (
            "t' = t s",
            "median error of the last crossing, of 7 decimals",
        ),
    }
)
"""Record of a method on random phases."""
NUMBERS = _floats(
    {
        "orbits": ("1", "number of orbits from random phases"),
        "seconds": ("s", "warm, one thread, the median, for all these orbits"),
        "prepare": ("s", "what the first solve took beyond: tables of maps, compilation"),
        "repeats": ("1", "how many repetitions the median is of"),
        "undecided": ("1", "number of symbols that the method does not vouch for"),
    },
    "numbers",
    gaps=False,
)
MANY: Layout = {**NUMBERS, "chosen": CHOSEN, "ended": ENDED}
"""Record of a method at ever more orbits."""
OF_BODIES = _floats(
    {
        "orbits": ("1", "orbits of each body, from random phases"),
        "first": ("s", "first call with a body: made ready and solved, for all these orbits"),
        "again": ("s", "the same call again, the median"),
        "symbols": ("1", "symbols compared: of orbits before the first that is in doubt"),
        "wrong": ("1", "of them wrong"),
        "wrong_trusted": ("1", "of them wrong and vouched for; without a cross-check, all wrong"),
        "undecided": ("1", "of them not vouched for"),
    },
    "bodies",
    gaps=False,
)
"""Record of a method with bodies drawn by lot."""
BODY = _floats(
    {
        "kept": ("1", "1 for a body that is the same in every run, 0 for one of the seed"),
        **{f"A{i}": ("", f"principal moment A{i}") for i in (1, 2, 3)},
        **{f"r{i}": ("1", f"centre of gravity, unit vector, axis {i}") for i in (1, 2)},
        "mu": ("", "weight times distance"),
        "h0": ("", "energy constant"),
        "J1_0": ("1", "initial action, dimensionless"),
    },
    "bodies",
    gaps=False,
)
OF_LOT: Layout = {**BODY, "ended": ENDED}
"""The bodies themselves."""
PROBLEM = {
    "title": Field(TEXT, (), "text", "the problem", within=ANY),
    "error": Field(TEXT, (), "text", "what its error is", within=ANY),
    "default": Field(TEXT, (), "text", "the method that rigidpend picks", within=ANY),
}

LAYOUT: Layout = {
    "<problems>": {**PROBLEM, "<methods>": SEARCHED},
    "meetings": {"<threads>": {"<problems that met>": {"ended": ENDED, "<methods that met>": MET}}},
    "random_phases": {"<starts>": {"<methods>": COUNTED}},
    "many_orbits?": {"<methods of many>": MANY},
    "bodies?": {**OF_LOT, "<methods with bodies>": OF_BODIES},
}
