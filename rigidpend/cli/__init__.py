"""Command line: thin modules of commands, which import heavy modules when they are used."""

import importlib
from typing import Any

import click

import rigidpend
from rigidpend.cli import common
from rigidpend.machine import signals, wording

COMMANDS = {
    "run": "run",
    **dict.fromkeys(("render", "report"), "render"),
    **dict.fromkeys(("list", "describe"), "show"),
    **{name: name for name in ("find", "certify")},
    **dict.fromkeys(("verify", "reference"), "verify"),
    **dict.fromkeys(("bench", "stress"), "measure"),
    **dict.fromkeys(("cache", "doctor"), "computer"),
}
"""Modules of the commands, in the order in which they are listed."""


def command(name: str) -> click.Command:
    """The command of a name."""
    module = importlib.import_module(f"rigidpend.cli.{COMMANDS[name]}")
    found: click.Command = getattr(module, f"{name}_command")
    # Set here, because click would cut a long first sentence.
    found.short_help = (found.help or "").partition("\n\n")[0]
    return found


class Commands(click.Group):
    """The commands, each imported when it is called; errors do not repeat long arguments."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        return command(cmd_name) if cmd_name in COMMANDS else None

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; an exception becomes a sentence and an exit code."""
        ctx.meta[common.OWED] = "--json" in ctx.args
        try:
            if signals.came():
                raise signals.Stopped
            return super().invoke(ctx)
        except click.UsageError as error:
            said = common.brief(error.format_message())
            common.print_failure(ctx, said, common.MISUSED)
            raise click.UsageError(said, error.ctx) from None
        # click handles these itself, with its own messages and exit codes.
        except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
            raise
        except (Exception, signals.Stopped, KeyboardInterrupt) as error:  # noqa: BLE001
            common.failed(ctx, error)
        finally:
            common.settle_stderr()


# Only the names, from which click suggests close ones for a misspelled command.
@click.group(
    cls=Commands,
    commands=dict[str, Any].fromkeys(COMMANDS),
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(rigidpend.__version__, prog_name="rigidpend")
def main() -> None:
    """Perturbed pendulum-like motions of a heavy rigid body: compute, draw, verify.

    Output goes to stdout, messages to stderr. Exit codes: 0 done or up to
    date; 1 failed or different; 2 wrong usage or config; 3 something needed is absent; 4 an
    error of rigidpend, with a log; 130 and 143 interrupted, with finished parts kept.

    The last example lets bash complete commands, options and names; zsh_source is for zsh.

    \b
    Examples:
      rigidpend list
      rigidpend run fig4
      rigidpend render fig4
      rigidpend run fig4 --set problem.J1_0=1e-10 --out /tmp/mine
      eval "$(_RIGIDPEND_COMPLETE=bash_source rigidpend)"
    """
    wording.say_warnings(common.say)
