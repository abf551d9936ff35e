"""make test-vcan: the bus on the kernel's real SocketCAN, here where this kernel has it, in a QEMU guest otherwise.

drive over the bench's hub, here          the reference
bus tests, drive over vcan0               where there is CAN (tests/vcan/inside.py)
both drives and candump's log compared    here (tests/vcan/test_drive.py)
"""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from hil.processes import ONE_THREAD
from tests.vcan import guest, needs
from tests.vcan.inside import HERE, drive, timed
from tests.vcan.interface import kernel_has_can
from tests.vcan.kernel import newest_package, unpack

BUILD = Path("build/vcan").resolve()
WORK = BUILD / "work"
LIMIT_S = 1800.0
UNAVAILABLE, SOFTWARE, INTERRUPTED = 69, 70, 130


def lacking(direct: bool) -> list[str]:
    """What must be installed or fetched first, each a line that says how."""
    packages = needs.missing(needs.DIRECT if direct else needs.GUEST)
    lines = [needs.install(packages)] if packages else []
    if not direct and newest_package(BUILD) is None:
        lines.append("No kernel for the guest. Fetch Debian's, 70 MB, into build/vcan with: sh tools/fetch_kernel.sh")
    return lines


def inside(direct: bool) -> int:
    """The exit code of tests.vcan.inside, run here or in the guest."""
    command = [sys.executable, "-m", "tests.vcan.inside", str(WORK)]
    if direct:
        return subprocess.run(command, check=False).returncode
    package = newest_package(BUILD)
    assert package is not None
    kernel, busybox = unpack(package), shutil.which("busybox", path=needs.SYSTEM_PATH)
    assert busybox is not None
    print(f"vcan: this kernel has no CAN: booting Debian's {kernel.version} in an emulated machine", flush=True)
    environment = {
        **ONE_THREAD,
        "PATH": needs.SYSTEM_PATH,
        "HOME": "/dev/shm",
        "TMPDIR": "/dev/shm",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    job = guest.Job(f"cd {shlex.quote(os.getcwd())} && {shlex.join(command)}", WORK, environment, LIMIT_S)
    return guest.run(kernel, Path(busybox), job)


def compare() -> int:
    """The exit code of pytest over what both drives left."""
    command = [sys.executable, "-m", "pytest", "-vv", "--tb=short", "--color=no", str(HERE / "test_drive.py")]
    return subprocess.run(command, env={**os.environ, "EL_DORADO_DRIVES": str(WORK)}, check=False).returncode


def run(direct: bool) -> int:
    """All parts; the exit code of the first that failed."""
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    with timed("drive over the hub"):
        code = drive("hub", WORK / "hub")
    with timed("all in the guest" if not direct else "all on this kernel"):
        code = code or inside(direct)
    with timed("comparison"):
        return code or compare()


def main() -> int:
    """Exit codes: 0 all passed, 69 something is not installed, 70 the guest failed, else of the part that failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.vcan", description="The bus tests on real SocketCAN.")
    parser.add_argument("--guest", action="store_true", help="in the guest, though this kernel may have CAN")
    parser.add_argument("--check", action="store_true", help="only say what is missing on this machine")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    direct = not options.guest and kernel_has_can()
    if lines := lacking(direct):
        print("\n".join(lines), file=sys.stderr)
        return UNAVAILABLE
    if options.check:
        return 0
    began = time.monotonic()
    try:
        code = run(direct)
    except guest.GuestError as error:
        print(f"vcan: {error}", file=sys.stderr)
        code = SOFTWARE
    except KeyboardInterrupt:
        print("vcan: ended by Ctrl-C", file=sys.stderr)
        return INTERRUPTED
    print(f"vcan: {'passed' if code == 0 else 'failed'} in {time.monotonic() - began:.0f} s")
    return code


if __name__ == "__main__":
    sys.exit(main())
