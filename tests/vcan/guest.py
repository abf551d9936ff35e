"""A guest: one command on a Debian kernel under QEMU, in this machine's own root file system, as root there.

Needs neither KVM, nor root, nor a mount, nor a disk image here: the processor is emulated (so that a guest is the same
everywhere), and the file system comes over 9p, read only but for one folder.
"""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.vcan.initramfs import EXIT_FILE, init_script, initramfs
from tests.vcan.kernel import Kernel

MEMORY = "2G"
# The last three: a busy machine may hold the guest up for seconds, which is no fault of its timer or of its programs.
KERNEL_WORDS = (
    "console=ttyS0 quiet panic=-1 mitigations=off no_timer_check nowatchdog rcupdate.rcu_cpu_stall_suppress=1"
)
QUIET_S = 20.0  # after so long a silence a line says that the guest is still there


class GuestError(RuntimeError):
    """The guest was not done in time, or ended without an exit code."""


@dataclass(frozen=True, slots=True)
class Job:
    """A shell command, the one folder it may write to (and /dev/shm, the guest's memory), its environment and time."""

    command: str
    work: Path
    environment: Mapping[str, str]
    limit_s: float


def run(kernel: Kernel, busybox: Path, job: Job) -> int:
    """Boot, do the job, stream what it prints; its exit code. No process is left, whatever happens. Raises GuestError.

    The work folder gets the file EXIT_FILE and the initramfs.
    """
    code_file, archive, modules = job.work / EXIT_FILE, job.work / "initramfs", kernel.modules()
    code_file.unlink(missing_ok=True)
    script = init_script(modules, job.work, job.environment, job.command)
    archive.write_bytes(initramfs(busybox, modules, script))
    with subprocess.Popen(
        _command(kernel, archive, job.work), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as machine:
        try:
            _stream(machine, job.limit_s)
        finally:
            machine.kill()
    if not code_file.exists():
        raise GuestError("the guest ended before its command did; see what it printed above")
    return int(code_file.read_text())


def _command(kernel: Kernel, archive: Path, work: Path) -> list[str]:
    return [
        "setpriv",
        "--pdeathsig",
        "KILL",  # no guest outlives us, even where we are killed
        "qemu-system-x86_64",
        "-nodefaults",
        "-no-user-config",
        "-display",
        "none",
        "-serial",
        "stdio",
        "-no-reboot",
        "-accel",
        "tcg,thread=multi",
        "-cpu",
        "max",
        "-smp",
        "2",
        "-m",
        MEMORY,
        "-kernel",
        str(kernel.image),
        "-initrd",
        str(archive),
        "-append",
        KERNEL_WORDS,
        "-virtfs",
        "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap",
        "-virtfs",
        f"local,path={work},mount_tag=work,security_model=none",
    ]


def _stream(machine: subprocess.Popen[bytes], limit_s: float) -> None:
    """Hand on what the guest prints, until its end. Raises GuestError after `limit_s`."""
    assert machine.stdout is not None
    started = heard = time.monotonic()
    while True:
        now = time.monotonic()
        if now - started > limit_s:
            raise GuestError(f"the guest was not done within {limit_s:.0f} s and is ended")
        if now - heard > QUIET_S:
            heard = now
            print(f"vcan: the guest works, {now - started:.0f} s", flush=True)
        if not select.select([machine.stdout], [], [], 1.0)[0]:
            continue
        data = os.read(machine.stdout.fileno(), 1 << 16)
        if not data:
            return
        heard = now
        sys.stdout.write(data.decode(errors="replace").replace("\r", ""))
        sys.stdout.flush()
