"""What a person finds without asking: help, examples that work, completion in a shell."""

import io
import itertools
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner
from PIL import Image

from rigidpend import cli, render
from tests.cli.calls import REFERENCE, call
from tests.config.samples import written

COMMANDS = {name: cli.command(name) for name in cli.COMMANDS}

BEGUN = {
    **dict.fromkeys(("run", "bench", "stress"), "runs.runner.follow"),
    "find": "routes.symbolic.find_orbit",
    "--decimals": "routes.symbolic.follow.round_phases",
    "certify": "runs.certificates.certify",
    "--check": "runs.certificates.check",
    "verify": "runs.references.verify",
    "reference": "runs.references.renew",
}
"""Words of examples that compute: run up to that function, they have tests of their own."""


def examples() -> Iterator[tuple[str, str]]:
    """Every line of an example in any help text, with its command."""
    for name, command in [("", cli.main), *COMMANDS.items()]:
        said = command.get_help(click.Context(command, info_name=f"rigidpend {name}".strip()))
        lines = iter(said.splitlines())
        if any(line.strip() in ("Example:", "Examples:") for line in lines):
            # Up to the next empty line.
            yield from ((name, line.strip()) for line in itertools.takewhile(bool, lines))


def test_every_command_says_in_its_first_line_what_it_does_and_has_examples(tmp_path: Path) -> None:
    assert {name for name, _ in examples()} == {"", *COMMANDS}
    for command in COMMANDS.values():
        assert command.help
        assert command.help.splitlines()[0].endswith(".")
        options = [option for option in command.params if isinstance(option, click.Option)]
        assert all(option.help for option in options)
    told = call(tmp_path, "--help").stdout.partition("Commands:\n")[2]
    assert "..." not in told
    assert [line.split()[0] for line in told.splitlines() if line[2] != " "] == list(COMMANDS)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the results that are named in examples."""
    folder = tmp_path_factory.mktemp("place")
    for inner in ("results/reference", "old/results", "swept"):
        (folder / inner).mkdir(parents=True)
    shutil.copy(REFERENCE / "fig1.h5", folder / "results" / "reference")
    for name in ("fig1", "fig2", "fig4", "fig5"):
        shutil.copy(REFERENCE / f"{name}.h5", folder / "results")
    for name in ("fig4_mu=1e-4", "fig4_mu=1e-3"):
        shutil.copy(REFERENCE / "fig4.h5", folder / "swept" / f"{name}.h5")
    return folder


def picture() -> bytes:
    drawn = io.BytesIO()
    Image.new("RGB", (9, 9)).save(drawn, "png")
    return drawn.getvalue()


def interrupt(*_: Any, **__: Any) -> None:
    raise KeyboardInterrupt


@pytest.mark.slow
@pytest.mark.parametrize(("name", "line"), sorted(set(examples())))
def test_every_example_works(
    place: Path, monkeypatch: pytest.MonkeyPatch, name: str, line: str
) -> None:
    before, _, target = line.partition(" > ")
    if before.startswith("eval"):
        # It is run in a shell, below.
        assert before == 'eval "$(_RIGIDPEND_COMPLETE=bash_source rigidpend)"'
        return
    program, *words = shlex.split(before)
    assert program == "rigidpend"
    words = [word.replace("/tmp", str(place)) for word in words]
    if words[0] == "cache":
        # Not the user's own: an example empties it.
        monkeypatch.setenv("XDG_CACHE_HOME", str(place / "cache"))
    # What is drawn has tests of its own; to begin processes takes longer than these few figures.
    monkeypatch.setattr(render, "image", lambda *_: picture())
    for module in ("rigidpend.render.report", "rigidpend.cli.render"):
        monkeypatch.setattr(f"{module}.FEW", 99)
    stops = [BEGUN[word] for word in words if word in BEGUN and "-n" not in words]
    for stop in stops:
        monkeypatch.setattr(f"rigidpend.{stop}", interrupt)
    # Processes would not be interrupted.
    words += ["-j", "1"] * (words[0] in ("find", "verify", "run"))
    done = call(place, *words)
    assert done.returncode == (130 if stops else 0), done
    if target:
        written(place, done.stdout, target)
        assert call(place, "describe", target).returncode == 0


def offered(*words: str) -> list[str]:
    shell = ShellComplete(cli.main, {}, "rigidpend", "_RIGIDPEND_COMPLETE")
    return [item.value for item in shell.get_completions(list(words[:-1]), words[-1])]


def test_names_of_configs_and_their_keys_are_completed(tmp_path: Path) -> None:
    assert {"fig1", "fig4"} <= set(offered("run", "fig"))
    assert "all" in offered("verify", "a") + offered("render", "fig1", "a")
    assert "fig5" in offered("describe", "fig5")
    [item] = ShellComplete(cli.main, {}, "rigidpend", "X").get_completions(["run"], "./min")
    assert item.type == "file"


@pytest.mark.parametrize(
    ("asked", "told"),
    [("source", "-F _rigidpend_completion rigidpend"), ("complete", "plain,fig4\n")],
)
def test_a_shell_completes(asked: str, told: str) -> None:
    """As the script says that click gives to bash."""
    words = {"COMP_WORDS": "rigidpend run fig", "COMP_CWORD": "2"}
    env = {**words, "_RIGIDPEND_COMPLETE": f"bash_{asked}"}
    done = CliRunner().invoke(cli.main, prog_name="rigidpend", env=env)
    assert (done.exit_code, told in done.stdout) == (0, True)
