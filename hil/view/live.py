"""Viewer of a live run (`--watch`): a separate process that reads the run's files and does not affect the run."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hil.processes import Processes
from hil.view.port import address, check_port

RECORDS = ("truth.mcap", "onboard.mcap", "field.npz")


@contextmanager
def watched(folder: Path, port: int) -> Iterator[str]:
    """Show the run that begins in this folder, inside the block; yields the address. Raises PortInUseError.

    Removes the records of an earlier run there, so that they are not shown. If the viewer dies, the run continues.
    """
    check_port(port)
    folder.mkdir(parents=True, exist_ok=True)
    for name in RECORDS:
        (folder / name).unlink(missing_ok=True)
    with Processes(folder) as processes:
        processes.start("watch", "hil", ["watch", str(folder), "--port", str(port), "--wait"])
        yield address(port)


def until_ctrl_c() -> None:
    """Wait for Ctrl-C, so that the viewer stays open."""
    try:
        while True:
            time.sleep(3600.0)
    except KeyboardInterrupt:
        return
