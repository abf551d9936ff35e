"""The first file system of a guest: busybox, kernel modules and an init that changes over to the host's own root.

Written here as the kernel reads it (cpio, format newc), so that neither root nor a mount is needed to make it.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

EXIT_FILE = "exit-code"
_FILE, _FOLDER = 0o100755, 0o040755
_INIT = """#!/busybox sh
for module in {modules}; do /busybox insmod /$module || /busybox echo "guest: no module $module"; done
option=trans=virtio,version=9p2000.L,msize=512000
/busybox mount -t 9p -o ro,cache=loose,$option host /host
/busybox mount -t 9p -o $option work /host{work}
/busybox mount -t proc proc /host/proc
/busybox mount -t sysfs sys /host/sys
/busybox mount -t devtmpfs dev /host/dev
/busybox mkdir -p /host/dev/shm
/busybox mount -t tmpfs shm /host/dev/shm
/busybox ifconfig lo 127.0.0.1
/busybox env -i {environment} /busybox chroot /host /bin/sh -c {command}
/busybox echo $? > /host{work}/{exit_file}
/busybox reboot -f
"""


def initramfs(busybox: Path, modules: Sequence[Path], script: str) -> bytes:
    """The archive: `modules` lie at its root by their names, `script` is /init."""
    files: dict[str, tuple[int, bytes]] = {"host": (_FOLDER, b""), "busybox": (_FILE, busybox.read_bytes())}
    files |= {module.name: (_FILE, module.read_bytes()) for module in modules}
    files["init"] = (_FILE, script.encode())
    entries = [_entry(number, name, mode, data) for number, (name, (mode, data)) in enumerate(files.items(), 1)]
    return b"".join([*entries, _entry(0, "TRAILER!!!", 0, b"")])


def init_script(modules: Sequence[Path], work: Path, environment: Mapping[str, str], command: str) -> str:
    """Loads the modules in this order, mounts, runs the command in the host's root, leaves its exit code in `work`.

    The host's root is read only; `work`, a folder of it, is not. The guest's memory is at /dev/shm.
    """
    return _INIT.format(
        modules=" ".join(module.name for module in modules),
        work=shlex.quote(str(work)),
        exit_file=EXIT_FILE,
        environment=" ".join(shlex.quote(f"{name}={text}") for name, text in environment.items()),
        command=shlex.quote(command),
    )


def _entry(number: int, name: str, mode: int, data: bytes) -> bytes:
    """One file: thirteen numbers of eight hexadecimal digits, then name and data, each filled up to four bytes."""
    numbers = (number, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(name) + 1, 0)
    head = b"070701" + "".join(f"{item:08X}" for item in numbers).encode() + name.encode() + b"\0"
    return head + bytes(-len(head) % 4) + data + bytes(-len(data) % 4)
