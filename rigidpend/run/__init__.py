"""Runs of experiments: plans, workers, progress, logs, checkpoints, provenance.

Modules
-------
runner      from configs to result files; what is up to date is left alone
parts       checkpoints: an interrupted run goes on from its finished parts
provenance  what a result was made from: versions, commit, machine, code
code_cache  what was read in source files, kept on disk
memory      what was found out before, kept on disk
recalled    configs that were read before, as far as a plan needs them
stored      what a plan needs of a result file, remembered
progress    progress display on a terminal
logs        progress and errors kept beside the results
cluster     parts computed by a Dask cluster
workers     threads and processes side by side
signals     Ctrl-C and SIGTERM: noted at once, heeded where work can end
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidpend.notebook import StoredResult


class CalledRun(ModuleType):
    """Module that is also the function `rigidpend.notebook.run`."""

    def __call__(self, *args: Any, **kwargs: Any) -> StoredResult:
        # By its name: what computes an experiment imports this package, but has no part in it.
        return import_module("rigidpend.notebook").run(*args, **kwargs)


sys.modules[__name__].__class__ = CalledRun
