"""`rigidpend completion`: the script by which a shell completes commands, names and keys."""

from __future__ import annotations

import click

from rigidpend.cli.common import guarded


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
@guarded
def command(context: click.Context, shell: str) -> None:
    """Print the script by which a shell completes commands, names and keys.

    Commands, options, names of configs and keys of --set.

    For every new shell: put the line of the example into ~/.bashrc, with zsh for bash into
    ~/.zshrc, or `rigidpend completion fish | source` into ~/.config/fish/config.fish.

    \b
    Example:
      eval "$(rigidpend completion bash)"
    """
    from click.shell_completion import get_completion_class

    kind = get_completion_class(shell)
    assert kind is not None
    root = context.find_root()
    maker = kind(root.command, {}, "rigidpend", "_RIGIDPEND_COMPLETE")
    # `source` would run bash to see how old it is, which a printed script need not.
    click.echo(maker.source_template % maker.source_vars())
