"""``python -m rigidpend`` is the command line."""

from rigidpend.cli import main

main(prog_name="rigidpend")
