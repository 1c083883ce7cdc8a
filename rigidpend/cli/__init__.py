"""Command line: one thin module for each command, which imports what is heavy when it is used."""

from __future__ import annotations

from typing import Any

import click

import rigidpend
from rigidpend.cli import (
    bench,
    cache,
    certify,
    common,
    completion,
    describe,
    doctor,
    find,
    listing,
    reference,
    render,
    report,
    run,
    stress,
    theory,
    verify,
)


class Brief(click.Group):
    """A group that repeats no long argument, and lists its commands in whole sentences."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            told = (
                (name, (each.help or "").partition("\n\n")[0])
                for name, each in self.commands.items()
            )
            formatter.write_dl([(name, " ".join(said.split())) for name, said in told])

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except click.UsageError as error:
            said = error.format_message()
            if common.brief(said) == said:
                raise
            raise click.UsageError(common.brief(said), error.ctx) from None


@click.group(cls=Brief, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(rigidpend.__version__, prog_name="rigidpend")
def main() -> None:
    """Perturbed pendulum-like motions of a heavy rigid body: compute, draw, verify.

    Output goes to stdout, messages to stderr. Exit codes: 0 done or up to
    date; 1 failed or different; 2 wrong usage or config; 3 something needed is absent; 4 an
    error of rigidpend, with a log; 130 and 143 interrupted, what is finished is kept.

    \b
    Examples:
      rigidpend list
      rigidpend run fig4
      rigidpend render fig4
      rigidpend run fig4 --set problem.J1_0=1e-10 --out /tmp/mine
      eval "$(rigidpend completion bash)"
    """
    common.settle_warnings()


for _module in (
    *(run, render, report, listing, describe, theory, find),
    *(certify, verify, reference, bench, stress, cache, doctor, completion),
):
    main.add_command(_module.command)
