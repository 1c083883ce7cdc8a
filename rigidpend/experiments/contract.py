"""Contract of an experiment: what each of the four files of its folder offers.

``__init__.py``
    ``LAYOUT``: what a result consists of, with unit and bound.
``schema.py``
    ``Config``, a subclass of :class:`rigidpend.config.schema.ExperimentConfig`: what a config may
    ask for.
``compute.py``
    ``compute(config, means)``: the data of a result file, plain values by name, of which ``LAYOUT``
    tells the rest; ArithmeticError where something that the config asks for cannot be computed as
    well as it must be. And if it likes:

    ``cost(config)``
        An estimate of the seconds that it takes on two cores, from what was measured of it:
        `run -n` tells it, and the time left begins with it.
    ``describe(config)``
        Rows on what follows from a config beside what follows from its body.
    ``PIECES = True``
        All its work goes through ``means.pieces``, so that a cluster shares it; what does not, a
        worker of the cluster computes as a whole.
    ``orbits(config, stored)``
        `Routes`, exact: its route codes can be proven. ``stored()`` loads ``/data`` of the
        config's result, for orbits that only a computation tells.
    ``theorems(config, data)``
        Sentences that ``/data`` of a result proves, checked again without integration;
        ArithmeticError or ValueError where it does not, whose text says what is not shown.
``draw.py``
    ``draw(result)``: a figure of a stored result. And if it likes:

    ``CAPTION``
        Sentences on what the figure shows, of whatever body.
    ``tables(result)``
        Tables of a stored result, which set its numbers beside those that the paper prints.

Nothing is registered; a folder with a ``schema.py`` is an experiment. `schema.py` and `compute.py`
import no matplotlib, `draw.py` no integrator, for each is loaded without the others; `__init__.py`
imports neither: whoever opens a result holds it against that layout first, and two results are
compared by it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from rigidpend.experiments.data import Tree
from rigidpend.machine.progress import tell_nobody
from rigidpend.orbits.integrate.arithmetic import CLOSED_FORM, Arithmetic

if TYPE_CHECKING:
    from rigidpend.numbers.exact import Exact
    from rigidpend.routes.problem import RouteProblem

Routes: TypeAlias = "Mapping[str, tuple[RouteProblem, Sequence[Exact]]]"
"""Orbits by the name of their array: a problem, and the exact phases of its columns."""


class Piece(NamedTuple):
    """A part that is still to be computed; another process may do it."""

    name: str
    """Name of letters, digits, ``_``, ``.`` and ``-``."""
    work: Callable[..., Tree]
    """A function of a module."""
    arguments: tuple[Any, ...]


def compute_in_order(pieces: Sequence[Piece]) -> Iterator[Tree]:
    """Compute parts one after the other, without checkpoints."""
    return (piece.work(*piece.arguments) for piece in pieces)


def compute_now(name: str, compute: Callable[[], Tree]) -> Tree:
    """Compute a part, without a checkpoint."""
    return compute()


class Means(NamedTuple):
    """The means of a computation: its arithmetic, workers, progress and checkpoints, if any."""

    arithmetic: Arithmetic = CLOSED_FORM
    """Arithmetic, resolved once: the record that the result file stores."""
    jobs: int = 1
    """Number of threads or processes at a time."""
    report: Callable[[str], None] = tell_nobody
    """Receiver of lines of progress."""
    part: Callable[[str, Callable[[], Tree]], Tree] = compute_now
    """Checkpoint: ``part(name, compute)`` is ``compute()``, kept for an interrupted run."""
    pieces: Callable[[Sequence[Piece]], Iterator[Tree]] = compute_in_order
    """Checkpoints whose functions and arguments may go to other machines; trees in their order."""
