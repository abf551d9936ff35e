"""Ctrl-C while a command still loads its modules: the process ends at once, without a traceback.

The `__main__` of onboard, hil and ground imports this module first. A test or a notebook that imports a command keeps
its signals; a SIGINT that the parent process ignores stays ignored.
"""

from __future__ import annotations

import signal
import sys
from pathlib import PurePath

_started = PurePath(sys.argv[0])
_name = _started.parent.name if _started.name == "__main__.py" else _started.name
if _name in ("onboard", "hil", "ground") and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def loaded() -> None:
    """Let Ctrl-C raise KeyboardInterrupt again. The first line of each `main`."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
