"""Contract of an experiment: what each of the four files of its folder offers.

``__init__.py``
    ``LAYOUT``: the fields of a result, with unit and bound.
``schema.py``
    ``Config``, a subclass of :class:`rigidpend.config.schema.ExperimentConfig`: what a config may
    ask for.
``compute.py``
    ``compute(config, means)``: the data of a result file, plain values by name; ``LAYOUT`` adds
    their units and meanings. ArithmeticError if something that the config asks for cannot be
    computed accurately enough. Optional:

    ``cost(config)``
        An estimate of the seconds that it takes on two cores by engine `taylor`, from measurements:
        `run -n` prints it, and the display of the time left begins with it.
    ``describe(config)``
        Rows on what follows from a config, beside those on its body.
    ``PIECES = True``
        All its work goes through ``means.pieces``, so that a cluster shares it. Without it one
        worker of the cluster computes the whole config.
    ``orbits(config, stored)``
        `Routes`, exact: its route codes can be proven. ``stored()`` loads ``/data`` of the
        config's result, for orbits that are known only after a computation.
    ``theorems(config, data)``
        Sentences that ``/data`` of a result proves, checked again without integration;
        ArithmeticError or ValueError if the proof fails, with a text that says what is not shown.
``draw.py``
    ``draw(result)``: a figure of a stored result. ``CAPTION``: sentences on what the figure shows,
    for any body. ``tables(result)``: tables of a stored result, with its numbers beside those that
    the paper prints; an empty list without any.

Nothing is registered; a folder with a ``schema.py`` is an experiment. `schema.py` and `compute.py`
import no matplotlib and `draw.py` no integrator, because each is loaded without the others.
`__init__.py` imports neither: a result is checked against its layout when it is opened, and two
results are compared by it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from operator import methodcaller
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from rigidpend.experiments.data import Tree
from rigidpend.machine.progress import tell_nobody
from rigidpend.machine.workers import worth_processes
from rigidpend.orbits.integrate.arithmetic import CLOSED_FORM, Arithmetic

if TYPE_CHECKING:
    from rigidpend.numbers.exact import Exact
    from rigidpend.routes.problem import RouteProblem

Routes: TypeAlias = "Mapping[str, tuple[RouteProblem, Sequence[Exact]]]"
"""Orbits by the name of their array: a problem, and the exact phases of its columns."""


class Piece(NamedTuple):
    """A part of a computation, which another process may do."""

    name: str
    """Name of letters, digits, ``_``, ``.`` and ``-``."""
    compute: Callable[[], Tree]
    """Computes it, without a checkpoint; made by `partial`, so that it can be pickled."""


class Means(NamedTuple):
    """The means of a computation: arithmetic, workers, progress and checkpoints."""

    arithmetic: Arithmetic = CLOSED_FORM
    """Arithmetic, resolved once; the result file stores it."""
    jobs: int = 1
    """Number of threads or processes at a time."""
    report: Callable[[str], None] = tell_nobody
    """Receiver of lines of progress."""
    pieces: Callable[[Sequence[Piece]], Iterator[Tree]] = partial(map, methodcaller("compute"))
    """Checkpoints: gives the trees of pieces in their order, each stored for an interrupted run.

    Other machines may compute them."""

    stored: Callable[[str], bool] = dict[str, bool]().__contains__
    """True for the name of a piece that an interrupted run has stored."""

    def part(self, name: str, compute: Callable[[], Tree]) -> Tree:
        """A single checkpoint, which this process computes: ``compute()``, stored as a piece is."""
        [tree] = self.pieces([Piece(name, compute)])
        return tree

    def threads(self, names: Sequence[str]) -> int:
        """Number of threads that each of the pieces of these names may take.

        Many that are to be computed go to processes of one thread each, because threads would wait
        for each other's Python code.
        """
        missing = [name for name in names if not self.stored(name)]
        return 1 if worth_processes(len(missing), self.jobs) else self.jobs
