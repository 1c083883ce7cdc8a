"""The five problems: one module each, with the task, its reference and its error, once.

Each module has

- ``TITLE``, ``ERROR``: what it is, and what its error is, for people;
- ``KIND``: what a method is asked for, a key of `methods.Method.answers`;
- ``DEFAULT``: the method that rigidpend picks for it by default;
- ``task(sizes)``: the task, from the sizes of `schema.Workload`;
- ``reference(task) -> dict of arrays``: the truth, in 113 bits or in closed form;
- ``error(answer, reference) -> dict of float``: ``error`` first, then what else is told.
"""

from __future__ import annotations

from typing import Any

NAMES = ("free_body", "pendulum", "codes", "precession_angle", "long_time")


def module(name: str) -> Any:
    """The module of a problem."""
    # Spelt out, so that the hash of the code that computes finds them.
    from rigidpend.experiments.bench.measuring.problems import (
        codes,
        free_body,
        long_time,
        pendulum,
        precession_angle,
    )

    found = (free_body, pendulum, codes, precession_angle, long_time)
    return dict(zip(NAMES, found, strict=True))[name]
