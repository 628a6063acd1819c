"""The command line in the interpreter's process."""

from __future__ import annotations

import signal
import sys


def main() -> None:
    """Runs the program with the arguments of the process and ends with its exit code.

    Signals do what they do to a program: the interpreter's own handlers are taken off first.
    """
    from . import _native

    # what was ignored when the process began (nohup) stays ignored; SIGPIPE is ignored by Python as by Rust
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_native.main(len(sys.argv) - 1))
