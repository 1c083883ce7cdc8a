"""What a config of an experiment may not ask for is refused, where it is written."""

import re

import pytest

from rigidpend.config import catalogue
from tests.config.samples import refused
from tests.experiments.trees import asked

PLANE = (
    "problem.theta2_0=1.2 problem.columns={axis: h0, ends: [1, 2], count: 3}"
    " problem.rows={axis: mu, ends: [1/1000, 2/1000], count: 4} problem.zooms={}"
)
"""A plane whose config gives columns."""
REFUSED = {
    "asymptotic_orbits": {
        "problem.h=0.001": "problem.h: h > mu is broken: h = 0.001, mu = 0.001",
        "problem.J1_0=1e-281": "problem.J1_0: expected 1e-280 to less than J2_0/2 = 0.7073, got 1",
        "problem.J1_0=0.7074": "problem.J1_0: expected 1e-280 to less than J2_0/2 = 0.7073, got 0",
    },
    "bench": {
        "problem.methods=[scipy_dop854]": "problem.methods: no such method: 'scipy_dop854'",
        "search.tolerances=[]": "search.tolerances: expected at least",
        "search.tolerances=[1e-9, 0]": "expected a tolerance, more than 0",
        "search.tolerances=[1]": "expected a tolerance, more than 0 and at most 0.1",
        "search.slowest=0": "search.slowest: expected seconds, more than 0",
        "meeting.rounds=0": "meeting.rounds: input should be greater",
        "bodies.methods=[]": "bodies.methods: expected at least",
        "numerics.engine=scipy": "numerics: unknown key",
    },
    "exponents": {"problem.n_symbols=11": "problem.n_symbols: input should be less"},
    "fig1": {
        "problem.A=[1, 2, 1.5]": "problem.A: A1 > A3 > A2 is broken",
        "problem.heights=[0.5, 1]": "problem.heights: a height |M3|/|M| is more than 0",
        "problem.heights=[1 - 1e-20]": "less than 1, got 1 - 1e-20, 1.0 in doubles",
        "problem.heights=[]": "problem.heights: expected at least",
        "problem.view.elevation=2": "problem.view.elevation: an elevation is from -pi/2",
        "problem.points=3": "problem.points: input should be greater than or equal to 9",
        "numerics.engine=scipy": "numerics: unknown key",
    },
    "fig2": {
        "problem.A=[1.01e150, 6e149, 1e150]": "problem.A: A1 is outside of 1e-150 to 1e+150",
        "problem.A=[1.6e-150, 9e-151, 1e-150]": "problem.A: A2 is outside of 1e-150 to 1e+150",
        "problem.r=[0, 0, 0]": "problem.r: r must have a direction",
        "problem.mu=0": "problem.mu: unknown key",
    },
    "fig3": {
        "problem.bodies.b=[2, 3, 1]": "problem.bodies.b: A1 > A3 > A2 is broken",
        **dict.fromkeys(
            ("problem.beta0=4", "problem.beta0=-1"), "problem.beta0: 0 <= beta0 <= pi is broken"
        ),
        "problem.bodies.b=[2, 1, 1.999999995]": "problem.bodies: the body of"
        " A = (2, 1, 1.999999995) is too nearly symmetric, nu = 3.14e+04:"
        " an orbit takes 5.7e+06 samples",
        "problem.beta0=alpha": "problem.beta0: 'alpha' is not understood",
        "problem.mu=-1": "problem.mu: mu >= 0 is broken",
        "problem.mu=0": "problem.mu: mu >= 1e-12 h0 is broken: mu = 0, h0 = 1",
        "problem.mu=1.9e-12": "problem.mu: mu >= 1e-12 h0 is broken",
        "problem.M_0=0": "problem.M_0: M_0 > 0 is broken",
        "problem.M_0=0.01": "problem.M_0: h0 = M_0^2/(2 A3) > mu is broken",
        "problem.J1_0=5.20e-4": "problem.J1_0: J1_0 < J2_0/2000 is broken",
        "problem.half_width=1": "problem.half_width: half_width must be more than 1",
        "problem.half_width=100.1": "problem.half_width: half_width must be more than 1",
        "problem.theta2_0.count=10001": "problem.theta2_0: at most 10000 orbits",
        "numerics.precisions=[53, 64]": "numerics.precisions: unknown key",
    },
    "fig4_zoom": {
        "problem.mu=0": "problem.mu: without a weight no orbit returns",
        "problem.between=[4.7, 47/10]": "the smaller one first, got 4.7 and 47/10",
        "problem.between=[4.8, 4.7]": "problem.between: expected two phases, the smaller one",
        "problem.symbol=16": "problem.symbol: symbol 16 is beyond n_symbols = 15",
        "problem.step=0": "problem.step: step must be greater than 0, got 0",
        "problem.step=1e-190": "problem.levels: the last level's step would be 1e-201, below",
        "problem.factor=1.999": "problem.factor: factor must be from 2 to 1000000, in at most 40",
        "problem.factor=1000001": "factor must be from 2 to 1000000",
        "problem.factor=9.22061431681464812345": "in at most 40 characters as a quotient, got 9.2",
    },
    "fig5": {"problem.n_wound=6": "problem.n_wound: n_wound = 6 is more than n_symbols = 5"},
    "full_shift": {
        "problem.mu=0": "mu > 0",
        "problem.h=0.0005": "h > mu",
        "problem.around=-1e-15": "a number from 0",
        "problem.approach=b 0^15": "needs h0: it belongs to starts",
        "problem.h=null problem.h0=1.3342 problem.approach=a 0^8 2^9": "symbols are 0 and 1",
        "problem.A=[2, 1.5, 1.5]": "A1 > A3 > A2 is broken",
        "problem.r=[1, 1, 0.1]": "r3 = 0 is broken",
    },
    "precession": {
        "problem.drawn=0.2": "problem.drawn: no such mu: 0.2 (known: 1e-5, 3e-5",
        "numerics.precisions=[53, 64]": "numerics.precisions: unknown key",
    },
    "route_map": {
        "problem.theta2_0.ends=[2, 1]": "problem.theta2_0.ends: the ends must ascend",
        "problem.theta2_0.ends=[1, 1.000000000000001]": "theta2_0.ends: 500 cells",
        "problem.rows={axis: log10_J1_0, ends: [-10, 1], count: 4}": "J1_0",
        "problem.rows={axis: gamma0, ends: [1, 2], count: 4}": "problem.rows",
        "problem.rows={axis: alpha0, ends: [1, 4], count: 4}": "pi > alpha0 > 0",
        "problem.A=[2, 0.5, 1.7] problem.rows={axis: alpha0, ends: [1, 2.5], count: 4}": (
            "problem.rows.ends: A2 + A3 >= A1"
        ),
        "problem.rows={axis: beta0, ends: [1, 4], count: 4}": "0 <= beta0 <= pi is broken",
        "problem.rows={axis: h0, ends: [1/10000, 2], count: 4}": "h0 > mu",
        "problem.rows.axis=log10_J1": "got 'log10_J1'; did you mean log10_J1_0?",
        "problem.n_symbols=251": "problem.n_symbols: input should be less",
        "problem.theta2_0.count=1": "count",
        "problem.theta2_0.cuont=1": "did you mean count",
        "problem.theta2_0=1": "theta2_0 is one number: give columns",
        "problem.columns={axis: h0, ends: [1, 2], count: 2}": "give theta2_0 as one number",
        "problem.rows={axis: theta2_0, ends: [0, 6], count: 2}": "rows: columns and rows are both",
        f"{PLANE} problem.rows={{axis: h0, ends: [1, 2], count: 4}}": "columns: columns and rows",
        f"{PLANE} problem.columns.ends=[2, 1]": "problem.columns.ends: the ends must ascend",
        f"{PLANE} problem.columns.ends=[1/10000, 1]": "problem.columns.ends: h0 > mu",
        f"{PLANE} problem.zooms={{a: {{rows: [1, 2]}}}}": "zooms.a: a zoom of this plane has",
        f"{PLANE} problem.zooms={{a: {{theta2_0: [4, 5], rows: [-8, -7]}}}}": "not theta2_0",
        f"{PLANE} problem.zooms={{a: {{columns: [2, 1], rows: [1, 2]}}}}": "zooms.a.columns",
    },
    "closed_orbits": {
        "problem.h=0.001": "problem.h: h > mu is broken: h = 0.001, mu = 0.001",
        "problem.h=1e20": "problem.h: h = 1e20 is outside of 1e-06 to 1e+06",
    },
    "splitting": {
        "problem.bodies.b.A=[2, 3, 1]": "problem.bodies.b.A: A1 > A3 > A2 is broken",
        "problem.bodies.b.r=[-1, 1, 0]": "problem.bodies.b.r: r1, r2 >= 0 is broken",
        "problem.mu=[1e-3, 1e-4]": "problem.mu: mu must ascend",
        "problem.mu=[0, 1e-4]": "problem.mu: mu must be more than 0",
        "problem.mu=[1e-4]": "problem.mu: expected at least 2",
        "problem.mu=[1e-4, 2]": "problem.h0: h0 > mu is broken: h0 = 1, mu = 2",
        "problem.h0=1e20": "problem.h0: h0 = 1e20 is outside of 1e-06 to 1e+06: take other units",
        "problem.mu=[1e-200, 1e-4]": "problem.mu: mu = 1e-200 is below 1e-100 h0",
        "problem.drawn=z": "problem.drawn: no such body: z (known: a, fig4, b",
        "problem.phases=3": "problem.phases: input should be greater than or equal to 9",
    },
    "stress": {
        "problem.honesty.tolerances=[1e-14, 1e-3]": "a spoilt tolerance is from 1e-13 to 0.01, got",
        "problem.honesty.tolerances=[1e-3, 0.1]": "a spoilt tolerance is from 1e-13 to 0.01, got",
    },
}
"""By config and settings, each of which begins with its part: the place and the reason told."""


@pytest.mark.parametrize(("name", "setting"), [(x, y) for x in REFUSED for y in REFUSED[x]])
def test_what_has_no_meaning_is_refused_where_it_is_written(name: str, setting: str) -> None:
    settings = re.split(r" (?=problem\.|numerics\.)", setting)
    [found] = refused(catalogue.known()[name], settings)
    assert REFUSED[name][setting] in str(found)
    assert ": problem: " not in str(found), "of a key, not of the whole section"


ACCEPTED = {
    "exponents": ["problem.n_symbols=10"],
    "fig1": ["problem.view.elevation=pi/2", "problem.points=9", "problem.heights=[0.001, 0.999]"],
    "fig3": [
        "problem.mu=2e-12",
        "problem.J1_0=5.18e-4",
        "problem.bodies.b=[2, 1, 1.99999999]",
        "problem.half_width=1.001",
        "problem.half_width=100",
        "problem.theta2_0.count=10000",
    ],
    "fig4_zoom": ["problem.symbol=15", "problem.factor=2", "problem.step=1e-188"],
    "fig5": ["problem.n_wound=5"],
    "route_map": ["problem.n_symbols=250"],
    "splitting": ["problem.phases=9"],
}
"""What is just within the bounds."""


@pytest.mark.parametrize(("name", "setting"), [(x, y) for x in ACCEPTED for y in ACCEPTED[x]])
def test_what_is_just_within_a_bound_is_accepted(name: str, setting: str) -> None:
    assert asked(name, setting) != asked(name)
