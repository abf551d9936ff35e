"""The watcher's address: a port of this machine's loopback, and whether it is free."""

from __future__ import annotations

import socket

HOST = "127.0.0.1"


class PortInUseError(OSError):
    """Somebody else listens there; the text says what to do."""


def check_port(port: int) -> None:
    """Raise PortInUseError if nothing can listen there."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError:
            raise PortInUseError(f"port {port} of {HOST} is in use; choose another with --port") from None


def address(port: int) -> str:
    """For the browser."""
    return f"http://{HOST}:{port}"
