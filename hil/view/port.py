"""Address of the viewer: a port on this machine's loopback interface, and the check that it is free."""

from __future__ import annotations

import socket

HOST = "127.0.0.1"


class PortInUseError(OSError):
    """Another program listens on the port; the text names the remedy."""


def check_port(port: int) -> None:
    """Raise PortInUseError if the port is not free."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError:
            raise PortInUseError(f"port {port} of {HOST} is in use; choose another with --port") from None


def address(port: int) -> str:
    """Address for the browser."""
    return f"http://{HOST}:{port}"
