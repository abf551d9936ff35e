"""Scanner's end of the cable: a TCP port or a pseudo terminal (see `hil.devices.lidar.cable`)."""

from __future__ import annotations

import errno
import os
import select
import socket
import tempfile
import tty
from pathlib import Path

from hil.devices.lidar.cable import Cable

SEND_BUFFER = 1 << 16  # a sensor does not buffer megabytes of old scans for a late client


class LidarServer(Cable):
    """TCP server on `host`; port 0 takes a free one. A second client waits until the first has gone."""

    def __init__(self, host: str = "127.0.0.1", port: int = 0) -> None:
        super().__init__()
        self._client: socket.socket | None = None
        self._listener: socket.socket | None = None
        self.host, self.port = host, port
        self._listen()
        self.address = f"tcp:{self.host}:{self.port}"

    @property
    def connected(self) -> bool:
        """See Cable."""
        return self._client is not None

    def fileno(self) -> int:
        """See Cable."""
        waiting = self._client or self._listener
        return waiting.fileno() if waiting else -1

    def disconnect(self) -> None:
        """See Cable."""
        if self._client is not None:
            self._client.close()
        self._client = None
        self._backlog.clear()

    def close(self) -> None:
        """See Cable."""
        self.disconnect()
        self.refuse(True)

    def refuse(self, refusing: bool) -> None:
        """Close the port while True: the system refuses new connections. A connected client stays."""
        super().refuse(refusing)
        if refusing and self._listener is not None:
            self._listener.close()
            self._listener = None
        elif not refusing and self._listener is None:
            self._listen()

    def _listen(self) -> None:
        # a long queue: a client that connects while another is served must not wait for the system's retry
        self._listener = socket.create_server((self.host, self.port), backlog=128)
        self._listener.setblocking(False)
        self.host, self.port = self._listener.getsockname()[:2]

    def _accept(self) -> None:
        if self._client is not None or self._listener is None:
            return
        try:
            client, _ = self._listener.accept()
        except (BlockingIOError, InterruptedError, ConnectionAbortedError):
            return
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        self._client = client
        self._began()

    def _read(self) -> bytes:
        if self._client is None:
            return b""
        try:
            piece = self._client.recv(65536)
        except (BlockingIOError, InterruptedError):
            return b""
        except OSError:
            piece = b""
        if not piece:
            self.disconnect()
        return piece

    def _flush(self) -> None:
        while self._backlog and self._client is not None:
            try:
                del self._backlog[: self._client.send(self._backlog)]
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                self.disconnect()


class LidarTerminal(Cable):
    """Pseudo terminal. `address` is a link that disconnect() removes; the next poll makes a new terminal under it.

    link: name of the link; default in a temporary folder. Raises FileExistsError if another file has that name.
    """

    def __init__(self, link: Path | None = None) -> None:
        super().__init__()
        self._folder = tempfile.TemporaryDirectory(prefix="lidar-")
        self._link = link or Path(self._folder.name) / "tty"
        if self._link.exists() and not self._link.is_symlink():
            raise FileExistsError(errno.EEXIST, "it is there already, and no link")
        self.address = f"tty:{self._link}"
        self._master = -1
        self._open = False
        self._plug()

    @property
    def connected(self) -> bool:
        """See Cable."""
        return self._open

    @property
    def hung_up(self) -> bool:
        """See Cable."""
        return not self._open

    def fileno(self) -> int:
        """See Cable."""
        return self._master

    def disconnect(self) -> None:
        """See Cable."""
        if self._master >= 0:
            os.close(self._master)
        self._master, self._open = -1, False
        self._link.unlink(missing_ok=True)
        self._backlog.clear()

    def refuse(self, refusing: bool) -> None:
        """See Cable."""
        super().refuse(refusing)
        if refusing:
            self.disconnect()

    def close(self) -> None:
        """See Cable."""
        self.disconnect()
        self._folder.cleanup()

    def _plug(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self._link.unlink(missing_ok=True)
        self._link.symlink_to(os.ttyname(slave))
        os.close(slave)  # from now on the master hangs up exactly while no client has it open
        os.set_blocking(self._master, False)

    def _accept(self) -> None:
        if self._master < 0 and not self._refusing:
            self._plug()
        was = self._open
        self._open = self._master >= 0 and not self._hung_up()
        if self._open and not was:
            self._began()

    def _hung_up(self) -> bool:
        waiting = select.poll()
        waiting.register(self._master, select.POLLIN)
        return any(event & select.POLLHUP for _, event in waiting.poll(0))

    def _read(self) -> bytes:
        if not self._open:
            return b""
        try:
            return os.read(self._master, 65536)
        except OSError:
            return b""

    def _flush(self) -> None:
        while self._backlog and self._open:
            try:
                del self._backlog[: os.write(self._master, self._backlog)]
            except OSError:
                return
