"""The command line: a module a command, thin; what is heavy is imported where it is used."""

from __future__ import annotations

import click

import rigidpend
from rigidpend.cli import describe, listing, render, report, run, verify


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(rigidpend.__version__, prog_name="rigidpend")
def main() -> None:
    """Perturbed pendulum-like motions of a heavy rigid body: run, look, check.

    \b
    Examples:
      rigidpend list
      rigidpend run fig4
      rigidpend render fig4
      rigidpend run fig4 --set problem.J1_0=1e-10 --out /tmp/mine
    """


for _module in (run, render, report, listing, describe, verify):
    main.add_command(_module.command)
