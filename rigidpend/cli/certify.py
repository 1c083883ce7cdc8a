"""`rigidpend certify`: prove route codes, and check certificates."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rigidpend.cli.common import configs_of, folder_of, print_json, say
from rigidpend.cli.options import FILE, JOBS, JSON, NAMED, OUT, SCHEDULER, SETTINGS, complete_names

if TYPE_CHECKING:
    from rigidpend.runs.certificates import Summary, Theorem


@click.command("certify")
@click.argument("names", nargs=-1, metavar=f"[{NAMED}]...", shell_complete=complete_names)
@SETTINGS
@click.option("--name", metavar="NAME", help="Name of the certificate, for one config.")
@OUT
@JOBS
@SCHEDULER
@click.option(
    "--check",
    "file",
    type=FILE,
    help="Check again the proof in a certificate, or in a result such as full_shift.h5 or"
    " fig4_intervals.h5, without integration.",
)
@click.option("--force", is_flag=True, help="Prove even if the certificate is up to date.")
@JSON
def certify_command(
    names: tuple[str, ...],
    settings: tuple[str, ...],
    name: str | None,
    folder: Path,
    jobs: int,
    scheduler: str | None,
    file: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Prove the symbols of route codes, each for the exact problem of the config.

    Writes FOLDER/NAME.certificate.h5, or for a RESULT.h5 a file beside it, with the proven
    symbols and the polynomials that prove them. An orbit that cannot be proven is undecided,
    with the reason; its code is never guessed. An interrupted proof continues when called again.

    \b
    Examples:
      rigidpend certify fig4
      rigidpend certify fig4 --set problem.J1_0=1e-12 --name lower
      rigidpend certify --check results/fig4.certificate.h5
    """
    if bool(names) == bool(file):
        raise click.UsageError("give names of configs, or a certificate with --check")
    from rigidpend.runs import certificates, loading

    # Printed at the end, so that --json gives one document.
    told: dict[str, Sequence[Summary | Theorem]] = {}
    if file:
        told[str(file)] = certificates.check(file, jobs=jobs, report=say)
    paths = configs_of(names, folder, name)
    how: Any = {"jobs": jobs, "force": force, "scheduler": scheduler}
    for path, [loaded] in zip(paths, loading.load_swept(paths, settings, (), name), strict=True):
        report, place = partial(say, of=loaded.name), folder_of(path, folder)
        told[loaded.name] = certificates.certify(loaded, place, report=report, **how)
    if as_json:
        print_json({of: [each._asdict() for each in found] for of, found in told.items()})
    else:
        for of, found in told.items():
            for each in found:
                click.echo(f"{of}: {each}")
