"""Programs that `make test-vcan` needs: program -> Debian package."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping

DIRECT: Mapping[str, str] = {"ip": "iproute2", "candump": "can-utils"}
GUEST: Mapping[str, str] = {
    **DIRECT,
    "qemu-system-x86_64": "qemu-system-x86",
    "busybox": "busybox-static",
    "setpriv": "util-linux",
}
SYSTEM_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"  # `ip` is often not on a user's own


def missing(needed: Mapping[str, str], path: str = SYSTEM_PATH) -> list[str]:
    """The packages whose program is not there."""
    return [package for program, package in needed.items() if shutil.which(program, path=path) is None]


def install(packages: Iterable[str]) -> str:
    """The line that names them with the command that installs them."""
    names = " ".join(packages)
    return f"Missing on this machine: {names}. Install with: sudo apt-get install -y --no-install-recommends {names}"
