"""The command `matbench`, also `python -m matbench`: ready for any terminal, and for Ctrl-C at any moment."""

import os
import signal
from types import FrameType


def main() -> None:
    """Run the command line and exit, as `matbench.cli.main` does."""
    _leave_at_once_on(signal.SIGINT)
    from matbench.commands import streams

    streams.open_lasting()
    streams.mend_width()
    from matbench import cli

    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    cli.main()


def _leave_at_once_on(number: int) -> None:
    # whoever ignores Ctrl-C for this process, as a shell does for one in the background, is heeded
    if signal.getsignal(number) is signal.default_int_handler:
        signal.signal(number, _leave)


def _leave(_number: int, _frame: FrameType | None) -> None:
    """End while modules are imported: an exception there comes out as another one, or is swallowed."""
    try:
        os.write(2, b"matbench: interrupted\n")
    finally:
        os._exit(130)


if __name__ == "__main__":
    main()
