"""What runs where the kernel has CAN, in the guest or here: the bus tests, then a drive over vcan0 with candump beside.

python -m tests.vcan.inside FOLDER: the folder gets the run and candump's log for tests/vcan/test_drive.py.
"""

from __future__ import annotations

import os
import shutil
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.vcan.interface import virtual_can

HERE = Path(__file__).parent
INTERFACE = "vcan0"
SCENARIO = HERE / "short_drive.toml"
LOG = "candump.log"
LAST = 0x7FF  # an id that the DBC has not


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Say how long it took."""
    began = time.monotonic()
    yield
    print(f"vcan: {what}: {time.monotonic() - began:.0f} s", flush=True)


def bus_tests() -> int:
    """The exit code of pytest."""
    command = [sys.executable, "-m", "pytest", "-vv", "--tb=short", "--color=no", str(HERE)]
    return subprocess.run(command, env={**os.environ, "EL_DORADO_CAN": INTERFACE}, check=False).returncode


def drive(can: str, out: Path) -> int:
    """The exit code of `hil run`; what it prints is in out/hil.log."""
    out.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "hil", "run", str(SCENARIO), "--can", can, "--out", str(out)]
    with (out / "hil.log").open("wb") as log:
        code = subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, check=False).returncode
    if code:
        print((out / "hil.log").read_text(errors="replace"), flush=True)
    return code


@contextmanager
def listening(interface: str, log: Path) -> Iterator[None]:
    """candump writes every frame of the interface to the log; the last is LAST, by which it is known to be whole."""
    with log.open("wb") as file, subprocess.Popen(["candump", "-L", "-r", "4000000", interface], stdout=file) as candump:
        try:
            yield
            with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as end:
                end.bind((interface,))
                end.send(struct.pack("=IB3x8s", LAST, 0, b""))
            deadline = time.monotonic() + 30.0
            while f" {LAST:03X}#\n".encode() not in log.read_bytes()[-80:] and time.monotonic() < deadline:
                time.sleep(0.05)
        finally:
            candump.terminate()


def main() -> int:
    """Exit code of the first part that failed, or 0."""
    folder = Path(sys.argv[1])
    with virtual_can(INTERFACE), TemporaryDirectory() as memory:
        with timed("bus tests"):
            code = bus_tests()
        if code:
            return code
        with timed("drive over vcan0"), listening(INTERFACE, Path(memory) / LOG):
            code = drive(f"socketcan:{INTERFACE}", Path(memory) / "real")
        shutil.copytree(memory, folder, dirs_exist_ok=True)
    return code


if __name__ == "__main__":
    sys.exit(main())
