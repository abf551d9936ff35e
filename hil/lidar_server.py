"""The scanner's end of the cable: a TCP port or a pseudo terminal for one client, for a single-threaded loop.

Neither ever blocks, and a client that comes or goes is a state. What a slow reader does not take waits; beyond BACKLOG
whole writes (whole scans) are dropped and counted, never cut.
"""

from __future__ import annotations

import os
import select
import socket
import tempfile
import tty
from pathlib import Path

BACKLOG = 1 << 18


class LidarServer:
    """TCP. `address` is what `onboard` gets as lidar.address; port 0 takes a free one."""

    def __init__(self, host: str = "127.0.0.1", port: int = 0) -> None:
        self.dropped = 0
        self._refusing = False
        self._client: socket.socket | None = None
        self._backlog = bytearray()
        self._listener = socket.create_server((host, port), backlog=1)
        self._listener.setblocking(False)
        self.host, self.port = self._listener.getsockname()[:2]
        self.address = f"tcp:{self.host}:{self.port}"

    @property
    def connected(self) -> bool:
        """Whether a client is there, as of the last poll or write."""
        return self._client is not None

    def fileno(self) -> int:
        """The client's descriptor, or the listener's while there is none: to wait on."""
        return (self._client or self._listener).fileno()

    def poll(self) -> bytes:
        """Accept who waits and return what came. A newcomer waits while there is a client."""
        if self._client is None and not self._accept():
            return b""
        self._flush()
        received = bytearray()
        while self._client is not None:
            try:
                piece = self._client.recv(65536)
            except (BlockingIOError, InterruptedError):
                break
            except OSError:
                piece = b""
            if not piece:
                self.disconnect()
            received += piece
        return bytes(received)

    def _accept(self) -> bool:
        try:
            client, _ = self._listener.accept()
        except (BlockingIOError, InterruptedError, ConnectionAbortedError):
            return False
        if self._refusing:
            client.close()
            return False
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client = client
        return True

    def write(self, data: bytes) -> int:
        """Send, or keep for later; the number of bytes accepted: all, or 0 without a client or with a full backlog."""
        if self._client is None or len(self._backlog) > BACKLOG:
            self.dropped += self._client is not None
            return 0
        self._backlog += data
        self._flush()
        return len(data) if self._client is not None else 0

    def _flush(self) -> None:
        while self._backlog and self._client is not None:
            try:
                del self._backlog[: self._client.send(self._backlog)]
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                self.disconnect()

    def disconnect(self) -> None:
        """Pull the plug."""
        if self._client is not None:
            self._client.close()
        self._client = None
        self._backlog.clear()

    def refuse(self, refusing: bool) -> None:
        """While True newcomers are turned away at once (a sensor that boots)."""
        self._refusing = refusing

    def close(self) -> None:
        """Free the port."""
        self.disconnect()
        self._listener.close()


class LidarTerminal:
    """A pseudo terminal with the interface of LidarServer. `address` is a link whose name survives disconnect()."""

    def __init__(self) -> None:
        self.dropped = 0
        self._refusing = False
        self._folder = tempfile.TemporaryDirectory(prefix="lidar-")
        self._link = Path(self._folder.name) / "tty"
        self.address = f"tty:{self._link}"
        self._backlog = bytearray()
        self._master = -1
        self._plug()

    def _plug(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self._link.unlink(missing_ok=True)
        self._link.symlink_to(os.ttyname(slave))
        os.close(slave)  # from now on the master hangs up exactly while no client has it open
        os.set_blocking(self._master, False)

    @property
    def connected(self) -> bool:
        """Whether a client has the terminal open."""
        if self._master < 0:
            return False
        waiting = select.poll()
        waiting.register(self._master, select.POLLIN)
        return not any(event & select.POLLHUP for _, event in waiting.poll(0))

    def fileno(self) -> int:
        """The terminal's descriptor, -1 while it is unplugged."""
        return self._master

    def poll(self) -> bytes:
        """What came since the last call."""
        if self._master < 0 and not self._refusing:
            self._plug()
        self._flush()
        received = bytearray()
        while self._master >= 0:
            try:
                piece = os.read(self._master, 65536)
            except (BlockingIOError, InterruptedError, OSError):
                break
            if not piece:
                break
            received += piece
        return bytes(received)

    def write(self, data: bytes) -> int:
        """As LidarServer.write."""
        if not self.connected:
            self._backlog.clear()
            return 0
        if len(self._backlog) > BACKLOG:
            self.dropped += 1
            return 0
        self._backlog += data
        self._flush()
        return len(data)

    def _flush(self) -> None:
        while self._backlog and self._master >= 0:
            try:
                del self._backlog[: os.write(self._master, self._backlog)]
            except OSError:
                return

    def disconnect(self) -> None:
        """Pull the plug; the next poll puts a new terminal under the same name unless refused."""
        if self._master >= 0:
            os.close(self._master)
        self._master = -1
        self._link.unlink(missing_ok=True)
        self._backlog.clear()

    def refuse(self, refusing: bool) -> None:
        """While True no terminal is there."""
        self._refusing = refusing
        if refusing:
            self.disconnect()

    def close(self) -> None:
        """Remove the terminal."""
        self.disconnect()
        self._folder.cleanup()
