"""Entry point of ``python -m rigidpend``: the command line."""

from rigidpend.cli import main

main(prog_name="rigidpend")
