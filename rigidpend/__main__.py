"""Entry point of the process, as ``rigidpend`` and as ``python -m rigidpend``."""

import os
import signal
import sys


def main() -> None:
    """Run the command line; from the first line on a signal ends it cleanly."""
    # Until the call of `watch` Ctrl-C ends the process as the system does, without a traceback.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    # No plugin of pydantic concerns our configs; looking for some takes a hundredth of the start.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    settle_streams()
    from rigidpend.machine import leave_garbage, signals

    leave_garbage()
    signals.watch()
    # Imported last: these imports take longer than many commands, and a signal must be heeded then.
    from rigidpend.cli import main as command

    command(prog_name="rigidpend")


def settle_streams() -> None:
    """Open closed standard streams on the null device, before another file takes their number."""
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115


if __name__ == "__main__":
    main()
