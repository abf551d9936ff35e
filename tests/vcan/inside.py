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
PLAIN_PYTEST = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # plugins that these tests do not use take long to load
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
    files = map(str, sorted(HERE.glob("test_real_*.py")))
    command = [sys.executable, "-m", "pytest", "-vv", "--tb=short", "--color=no", *files]
    environment = {**os.environ, **PLAIN_PYTEST, "EL_DORADO_CAN": INTERFACE}
    return subprocess.run(command, env=environment, check=False).returncode


def drive(can: str, out: Path) -> int:
    """The exit code of tests.vcan.drive; the run is in `out`."""
    return subprocess.run([sys.executable, "-m", "tests.vcan.drive", can, str(out)], check=False).returncode


@contextmanager
def listening(interface: str, log: Path) -> Iterator[None]:
    """candump writes every frame of the interface to the log; the last is LAST, by which it is known to be whole."""
    command = ["candump", "-L", "-r", "4000000", interface]
    with log.open("wb") as file, subprocess.Popen(command, stdout=file) as candump:
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
