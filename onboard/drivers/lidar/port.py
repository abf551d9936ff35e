"""Factory of the scanner's port by its address: TCP, USB or a serial line, all behind `LidarPort`."""

from __future__ import annotations

from onboard.config import ConfigError
from onboard.drivers.lidar.byte_port import LidarPort as LidarPort
from onboard.drivers.lidar.tcp_port import TcpPort
from onboard.drivers.lidar.tty_port import SPEEDS, TtyPort


def open_port(address: str, name: str = "lidar.address") -> LidarPort:
    """Return the port of an address, not connected yet. name: of its setting or argument, for messages.

    Raises ConfigError if it is none of tcp:HOST:PORT, tty:PATH and tty:PATH@BITRATE.
    """
    kind, _, rest = address.partition(":")
    if kind == "tcp":
        host, _, port = rest.rpartition(":")
        if host and port.isdigit() and 0 < int(port) < 65536:
            return TcpPort(address, host, int(port))
    if kind == "tty" and rest.startswith("/"):
        path, mark, rate = rest.partition("@")
        if not mark:
            return TtyPort(address, path)
        if rate.isdigit() and int(rate) in SPEEDS:
            return TtyPort(address, path, int(rate))
        raise ConfigError(f"{name} = {address!r}: the bit rate should be one of {', '.join(map(str, SPEEDS))}")
    raise ConfigError(
        f"{name} = {address!r} should be tcp:HOST:PORT (tcp:192.168.0.10:10940), "
        "tty:PATH (tty:/dev/ttyACM0) or tty:PATH@BITRATE (tty:/dev/ttyUSB0@115200)"
    )
