"""`rigidpend find`: the orbit that has a given route code, to any number of digits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from rigidpend.cli import complete
from rigidpend.cli.common import JSON, SETTINGS, guarded, print_json, print_table, say

if TYPE_CHECKING:
    from rigidpend.routes.symbolic import FoundOrbit

SHOWN = 400
"""Largest number of characters of an address that the table shows; --json has all."""


@click.command("find")
@click.argument("name", default="fig4", metavar="[NAME|FILE.yaml]", shell_complete=complete.names)
@click.option(
    "--code",
    required=True,
    metavar="CODE",
    help="Symbols, 0011, or each with its half rotations, 'a 0^11 1^10 1^11'.",
)
@click.option(
    "--near",
    metavar="PHASE",
    help="Take the half rotations of this theta2_0 (radians), as far as it has the code.",
)
@click.option(
    "--digits", type=int, default=28, show_default=True, help="Digits of theta2_0 behind the point."
)
@click.option(
    "--decimals",
    type=int,
    metavar="N",
    help="List all phases with N decimals, 0 to 4, whose orbits have the code.",
)
@SETTINGS
@JSON
@guarded
def command(
    name: str,
    code: str,
    near: str | None,
    digits: int,
    decimals: int | None,
    settings: tuple[str, ...],
    as_json: bool,
) -> None:
    """Find the initial phase whose orbit has a given route code.

    NAME is a config with one body, an energy constant h0 and an initial action J1_0, as fig4 and
    fig5. Where half rotations are not given they are few. Integration of the full equations
    confirms the symbols that the digits determine. Infinitely many orbits have a code: --decimals
    lists those whose phase is round. Exit code 1: there is no such orbit, and why.

    \b
    Examples:
      rigidpend find fig4 --code 0001101
      rigidpend find fig5 --code 00011 --near 1.02
      rigidpend find fig5 --code 00011 --decimals 2
      rigidpend find fig4 --code "0^11 1^10 1^11" --digits 45 --json
    """
    from rigidpend.config.names import resolve
    from rigidpend.runs import loading

    [path, *others] = resolve((name,))
    if others:
        raise click.UsageError("find is about one config, not all")
    problem: Any = loading.load(path, settings).content.problem
    if not all(hasattr(problem, each) for each in ("body", "h0", "J1_0")):
        raise click.UsageError(f"{path} has not one body, h0 and J1_0, as fig4 and fig5 have")
    given = {name: getattr(problem, name) for name in ("body", "h0", "J1_0")}
    if decimals is not None:
        if near is not None:
            raise click.UsageError("--decimals lists orbits, and --near chooses one: give one")
        _list(code, decimals, given, as_json)
        return
    from rigidpend.machine.workers import cores
    from rigidpend.routes.symbolic import find_orbit

    found = find_orbit(code=code, near=near, digits=digits, jobs=cores(), **given)
    if as_json:
        print_json(_document(found))
    else:
        print_table(_rows(found))


def _list(code: str, decimals: int, given: dict[str, Any], as_json: bool) -> None:
    """Print the round phases of a code."""
    from rigidpend.machine.workers import cores
    from rigidpend.routes.symbolic import NoOrbit
    from rigidpend.routes.symbolic.follow import round_phases

    found = round_phases(code=code, decimals=decimals, jobs=cores(), **given)
    if not found.theta2_0:
        raise NoOrbit(
            f"none of the {found.tried} phases with {decimals} decimals has this code: try one more"
        )
    rows = [
        (str(phase), "outside of the return map" if address is None else str(address))
        for phase, address in zip(found.theta2_0, found.addresses, strict=True)
    ]
    if as_json:
        phases = [{"theta2_0": phase, "address": address} for phase, address in rows]
        print_json({"phases": phases, "tried": found.tried, "uncertain": found.uncertain})
    else:
        print_table(rows)
        say(f"{len(rows)} of {found.tried} phases; {found.uncertain} have uncertain symbols")


def _rows(found: FoundOrbit) -> list[tuple[str, str, str]]:
    n, address = len(found.address.symbols), str(found.address)
    cut = address if len(address) <= SHOWN else address[: SHOWN - 3] + "..."
    return [
        ("theta2_0", str(found.theta2_0), "initial phase, radians"),
        ("address", cut, "first cell, then symbol^half rotations of each passage"),
        ("symbols", str(n), "in the code"),
        ("fixed", str(found.fixed), "of them, from the first, are determined by these digits"),
        ("confirmed", str(found.confirmed), f"of these, by integration in {found.bits} bits"),
        ("passages", str(found.passages), "of all, each integrated alone, have their symbol"),
        ("passage_error", f"{found.passage_error:.2g}", "largest error of their times, t'"),
        ("delay", f"{found.delay:.2g}", "largest difference of crossing times, t'"),
        ("residual", f"{found.residual:.2g}", "where passages meet"),
    ]


def _document(found: FoundOrbit) -> dict[str, Any]:
    address = found.address
    arrays = {name: getattr(found, name).tolist() for name in ("chi", "d", "I", "crossing_time")}
    return {
        "theta2_0": str(found.theta2_0),
        "address": str(address),
        "first": address.first,
        "symbols": list(address.symbols),
        "half_turns": list(address.half_turns or ()),
        **{
            name: getattr(found, name)
            for name in ("digits", "fixed", "confirmed", "bits", "delay", "passages")
        },
        "passage_error": found.passage_error,
        "residual": found.residual,
        **arrays,
    }
