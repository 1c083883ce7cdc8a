"""`rigidpend find`: the orbit that has a given route code, to any number of digits."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rigidpend.cli.common import DONE, FAILED, print_json, print_table, say
from rigidpend.cli.options import FILE, JOBS, JSON, SCHEDULER, SETTINGS, complete_names
from rigidpend.config.catalogue import resolve
from rigidpend.machine.progress import tell_nobody
from rigidpend.machine.wording import plain

if TYPE_CHECKING:
    from rigidpend.routes.symbolic import FoundOrbit

SHOWN = 400
"""Largest number of characters of an address that the table shows; --json shows all."""


@click.command("find")
@click.argument("name", default="fig4", metavar="[NAME|FILE.yaml]", shell_complete=complete_names)
@click.option(
    "--code",
    "codes",
    required=True,
    multiple=True,
    metavar="CODE",
    help="Symbols, 0011, or each with its half rotations, 'a 0^11 1^10 1^11'. May be given"
    " again: each code then has one row.",
)
@click.option(
    "--near",
    metavar="PHASE",
    help="Choose the orbit with the half rotations of the orbit at this theta2_0 (radians), as far"
    " as that has the code. Without it fig5 has 00011 at 5.5225; --near 1.02 finds the orbit beside"
    " 1.02.",
)
@click.option(
    "--digits", type=int, default=28, show_default=True, help="Digits of theta2_0 after the point."
)
@click.option(
    "--decimals",
    type=int,
    metavar="N",
    help="List all phases with N decimals (0 to 4) whose orbits have the code: N = 2 tries 0.00 to"
    " 6.28.",
)
@click.option(
    "--proof",
    type=FILE,
    metavar="FILE",
    help="Prove by small sets along the orbit that one has the whole code, and write the proof,"
    " X.orbit.certificate.h5; certify --check checks it.",
)
@SETTINGS
@JSON
@JOBS
@SCHEDULER
def find_command(
    name: str,
    codes: tuple[str, ...],
    near: str | None,
    digits: int,
    decimals: int | None,
    proof: Path | None,
    settings: tuple[str, ...],
    as_json: bool,
    jobs: int,
    scheduler: str | None,
) -> None:
    """Find the initial phase whose orbit has a given route code.

    NAME is a config with one body, an energy constant h0 and an initial action J1_0, as fig4 and
    fig5. Half rotations that are not given are chosen small. Integration of the full equations
    confirms the symbols that the digits determine. Infinitely many orbits have a code: --decimals
    lists those with phases of few decimals. Exit code 1: there is no such orbit, with the reason.

    \b
    Examples:
      rigidpend find fig4 --code 0001101
      rigidpend find fig5 --code 00011 --near 1.02
      rigidpend find fig4 --code 0110100110010110 --proof results/x.orbit.certificate.h5
      rigidpend find fig5 --code 00011 --decimals 2
      rigidpend find fig4 --code 0001 --code 0010 --code 0011
      rigidpend find fig4 --code "0^11 1^10 1^11" --digits 45 --json
    """
    from rigidpend.machine.workers import listening
    from rigidpend.routes import symbolic
    from rigidpend.routes.symbolic import address
    from rigidpend.runs import loading

    # All are read before the search for the first, which may take minutes.
    list(map(address.parsed, codes))
    [path, *others] = resolve((name,))
    if others:
        raise click.UsageError("find takes one config, not all")
    loaded = loading.load(path, settings)
    problem: Any = loaded.content.problem
    if not all(hasattr(problem, each) for each in ("body", "h0", "J1_0")):
        raise click.UsageError(
            f"{path}: find needs one body, one h0 and one J1_0, as in fig4 and fig5"
        )
    given = {name: getattr(problem, name) for name in ("body", "h0", "J1_0")}
    many = len(codes) > 1 or scheduler is not None
    if proof and (decimals is not None or many):
        raise click.UsageError("--proof proves one orbit of one --code, on this machine")
    if decimals is not None:
        if near is not None:
            raise click.UsageError(
                "--decimals lists orbits, and --near chooses one: give only one of them"
            )
        if many:
            raise click.UsageError("--decimals lists the orbits of one --code, on this machine")
        _list(codes[0], decimals, given, as_json, jobs)
        return
    given |= {"near": near, "digits": digits}
    if many:
        pieces = list(dict.fromkeys(codes))
        documents = _computed(pieces, given, jobs, loaded.content.experiment, scheduler)
        if as_json:
            print_json(documents)
        else:
            print_table([_row(document) for document in documents])
        sys.exit(FAILED if any("error" in document for document in documents) else DONE)
    if proof:
        from rigidpend.runs import orbit_proofs

        # Checked before a search that may take minutes.
        orbit_proofs.prepare(proof)
    with listening(say):
        found = symbolic.find_orbit(code=codes[0], jobs=jobs, **given)
    if as_json:
        print_json(_document(found))
    else:
        print_table(_rows(found))
    if proof:
        orbit_proofs.prove(loaded, found, proof, jobs=jobs, report=say)


def _computed(
    codes: list[str], given: dict[str, Any], jobs: int, experiment: str, scheduler: str | None
) -> list[dict[str, Any]]:
    """The orbits of many codes as plain data, by processes here or by a cluster."""
    if scheduler is None:
        from rigidpend.machine.workers import listening, note, side_by_side

        over: list[str] = []

        def hear(code: str) -> None:
            over.append(code)
            note(lambda: f"{len(over)} of {len(codes)} codes are done")

        with listening(say):
            return side_by_side(_found, (given,), True, codes, jobs, hear)
    from rigidpend.experiments.contract import Piece
    from rigidpend.runs import cluster

    pieces = [Piece(str(k), partial(_found, code, given)) for k, code in enumerate(codes)]
    come = cluster.gathered(scheduler, experiment, "taylor", pieces, say)
    by_name = {name: found for found, name, _ in come}
    return [by_name[piece.name] for piece in pieces]


def _found(
    code: str, given: dict[str, Any], done: Callable[[str], object] = tell_nobody
) -> dict[str, Any]:
    """The orbit of a code as plain data, or the reason for none; `done` is called afterwards."""
    from rigidpend.routes.symbolic import NoOrbit, find_orbit

    try:
        found = {"code": code} | _document(find_orbit(code=code, **given))
    except NoOrbit as error:
        found = {"code": code, "error": str(error)}
    done(code)
    return found


def _row(document: dict[str, Any]) -> tuple[str, str, str]:
    code = plain(document["code"], SHOWN)
    if "error" in document:
        return code, "-", document["error"]
    confirmed = f"{document['confirmed']} of {len(document['symbols'])} symbols confirmed"
    return code, document["theta2_0"], f"{plain(document['address'], SHOWN)}; {confirmed}"


def _list(code: str, decimals: int, given: dict[str, Any], as_json: bool, jobs: int) -> None:
    """Print the phases of few decimals whose orbits have a code."""
    from rigidpend.machine.workers import listening
    from rigidpend.routes.symbolic import NoOrbit
    from rigidpend.routes.symbolic.follow import round_phases

    with listening(say):
        found = round_phases(code=code, decimals=decimals, jobs=jobs, **given)
    if not found.theta2_0:
        raise NoOrbit(
            f"none of the {found.tried} phases with {decimals} decimals has this code: try one"
            " decimal more"
        )
    addresses = ("outside of the return map" if x is None else str(x) for x in found.addresses)
    rows = list(zip(map(str, found.theta2_0), addresses, strict=True))
    if as_json:
        phases = [{"theta2_0": phase, "address": address} for phase, address in rows]
        print_json({"phases": phases, "tried": found.tried, "uncertain": found.uncertain})
    else:
        print_table(rows)
        say(f"{len(rows)} of {found.tried} phases; {found.uncertain} have uncertain symbols")


def _rows(found: FoundOrbit) -> list[tuple[str, str, str]]:
    n = len(found.address.symbols)
    return [
        ("theta2_0", str(found.theta2_0), "initial phase, radians"),
        (
            "address",
            plain(str(found.address), SHOWN),
            "first cell, then symbol^half rotations of each passage",
        ),
        ("symbols", str(n), "in the code"),
        ("fixed", str(found.fixed), "of them, the first ones, are determined by these digits"),
        ("confirmed", str(found.confirmed), f"of these, by integration in {found.bits} bits"),
        ("passages", str(found.passages), "of all have their symbol, each integrated alone"),
        ("passage_error", f"{found.passage_error:.2g}", "largest error of their times, t'"),
        ("delay", f"{found.delay:.2g}", "largest difference of crossing times, t'"),
        ("residual", f"{found.residual:.2g}", "where passages meet"),
    ]


def _document(found: FoundOrbit) -> dict[str, Any]:
    address = found.address
    return found._asdict() | {
        "theta2_0": str(found.theta2_0),
        "address": str(address),
        "first": address.first,
        "symbols": found.word,
        "half_turns": list(address.half_turns or ()),
    }
