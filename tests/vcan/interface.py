"""A virtual CAN interface of this kernel, made and removed with `ip`."""

from __future__ import annotations

import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from tests.vcan.needs import SYSTEM_PATH


class LinkError(RuntimeError):
    """`ip` refused; the text is its own."""


def ip_link(*words: str) -> None:
    """`ip link WORDS`. Raises LinkError."""
    done = subprocess.run(
        ["ip", "link", *words], env={"PATH": SYSTEM_PATH}, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise LinkError(f"ip link {' '.join(words)}: {done.stderr.strip()}")


@contextmanager
def virtual_can(name: str) -> Iterator[str]:
    """The interface, up; one that was there before is taken as it is and stays. Raises LinkError."""
    there = name in (known for _, known in socket.if_nameindex())
    if not there:
        ip_link("add", "dev", name, "type", "vcan")
    try:
        ip_link("set", name, "up")
        yield name
    finally:
        if not there and name in (known for _, known in socket.if_nameindex()):
            ip_link("del", name)


def kernel_has_can() -> bool:
    """Whether this kernel has CAN sockets and lets us make a virtual interface."""
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
        with virtual_can("vcan99"):
            return True
    except (OSError, LinkError):
        return False
