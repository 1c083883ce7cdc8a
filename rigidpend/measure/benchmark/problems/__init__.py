"""The five problems: one module each, with the task, its reference and its error, once.

Each module has

- ``TITLE``, ``ERROR``: what it is, and what its error is, for people;
- ``KIND``: what a method is asked for, a key of `methods.Method.answers`;
- ``DEFAULT``: the method that rigidpend picks for it by default;
- ``task(sizes)``: the task, from :class:`Sizes`;
- ``reference(task) -> dict of arrays``: the truth, in 113 bits or in closed form;
- ``error(answer, reference) -> dict of float``: ``error`` first, then what else is told.
"""

from __future__ import annotations

from typing import Any, NamedTuple

NAMES = ("free_body", "pendulum", "codes", "precession_angle", "long_time")


class Sizes(NamedTuple):
    """How large the problems are."""

    orbits: int = 16
    """Orbits of the free body and of the pendulum, carried at once."""
    turns: float = 25
    """How long these are followed, in turns about the third axis."""
    columns: int = 63
    """Phases k/10 of Fig. 4."""
    n_symbols: int = 15
    companions: int = 8
    """Orbits of the problem over long times, carried at once."""
    periods: float = 1e5
    """Over which their integrals may drift."""


def module(name: str) -> Any:
    """The module of a problem."""
    # Spelt out, so that the hash of the code that computes finds them.
    from rigidpend.measure.benchmark.problems import (
        codes,
        free_body,
        long_time,
        pendulum,
        precession_angle,
    )

    found = (free_body, pendulum, codes, precession_angle, long_time)
    return dict(zip(NAMES, found, strict=True))[name]
