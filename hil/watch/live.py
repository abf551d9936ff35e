"""`--watch`: the watcher of a run as a process of its own, which reads the run's files. The run never hears of it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hil.processes import Processes
from hil.watch.port import address, check_port

RECORDS = ("truth.mcap", "onboard.mcap", "field.npz")


@contextmanager
def watched(folder: Path, port: int) -> Iterator[str]:
    """Inside the block the run that begins in this folder is shown; gives the address. Raises PortInUseError.

    The records of an earlier run there are removed: they are not to be shown. The watcher may die, the run goes on.
    """
    check_port(port)
    folder.mkdir(parents=True, exist_ok=True)
    for name in RECORDS:
        (folder / name).unlink(missing_ok=True)
    with Processes(folder) as processes:
        processes.start("watch", "hil", ["watch", str(folder), "--port", str(port), "--wait"])
        yield address(port)


def until_ctrl_c() -> None:
    """Hold, so that the run can still be looked at."""
    try:
        while True:
            time.sleep(3600.0)
    except KeyboardInterrupt:
        return
