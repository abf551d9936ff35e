"""Loop of the viewer: reads new data of the run, and updates the browsers' scene to the player's time."""

from __future__ import annotations

import io
import json
import logging
import time
from collections import deque
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import viser

from hil.view.browser.panel import Panel
from hil.view.browser.player import Player
from hil.view.browser.scene import Scene
from hil.view.folder import Folder
from hil.view.port import HOST, PortInUseError, address, check_port
from hil.view.story import TrueGround
from onboard.config import Rover, load
from onboard.records import F64

PERIOD_S = 0.1
RTF_OVER_S = 5.0
BACK_M, UP_M = 3.2, 2.4  # initial position of the camera, from the rover


def open_server(port: int) -> viser.ViserServer:
    """Open a server for this machine's browsers only. Raises PortInUseError."""
    check_port(port)
    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # browsers open spare connections: logged as errors
    with redirect_stdout(io.StringIO()):  # it prints a banner
        server = viser.ViserServer(host=HOST, port=port, label="El Dorado", verbose=False)
    if server.get_port() != port:  # another program took the port meanwhile: the server chose the next one
        server.stop()
        raise PortInUseError(f"port {port} of {HOST} is in use; choose another with --port")
    return server


class Watcher:
    """Viewer of one folder: server, player, scene and panel. Call `step` each period, `close` at the end."""

    def __init__(self, folder: Folder, server: viser.ViserServer, rover: Rover | None = None) -> None:
        folder.read()
        self.folder, self.server = folder, server
        live = not folder.finished
        self.player = Player(following=live)
        self.scene = Scene(server.scene, folder.ground, rover or load().rover)
        self.panel = Panel(server.gui, self.scene, live)
        self._rtf = Rtf() if live else None
        self._flown_rtf = 0.0 if live else flown_rtf(folder.path)
        first = folder.story.at(0.0)
        self._here_m = np.array(first.moment.position_m) if first else np.zeros(3)
        look_from(server, folder.ground, self._here_m)

    def step(self, wall_s: float, now_s: float) -> None:
        """Run one step. wall_s: time since the last step; now_s: time of the same clock. Raises NoRunError."""
        self.folder.read()
        story, player = self.folder.story, self.player
        while not self.panel.clicks.empty():
            self.panel.clicks.get()(player, story.end_s)
        player.advance(wall_s, story.end_s)
        instant = story.at(player.time_s)
        if instant is None:
            return
        rtf = self._rtf.at(now_s, story.end_s) if self._rtf and not self.folder.finished else self._flown_rtf
        with self.server.atomic():
            self.scene.show(instant)
            self.panel.show(instant, player, story.end_s, rtf)
        self._accompany(np.array(instant.moment.position_m))

    def _accompany(self, here_m: F64) -> None:
        """Move the browsers' cameras with the rover, at (3,), if selected."""
        moved_m, self._here_m = here_m - self._here_m, here_m
        if self.panel.accompanies and moved_m.any():
            for client in self.server.get_clients().values():
                client.camera.position = client.camera.position + moved_m  # the point that it looks at moves too

    def close(self) -> None:
        """Stop the server, disconnect the browsers and free the port."""
        with redirect_stdout(io.StringIO()):
            self.server.stop()


class Rtf:
    """Real-time factor over the last seconds: bench time by wall time."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float]] = deque()

    def at(self, now_s: float, end_s: float) -> float:
        """Factor at `now_s`. end_s: newest bench time of the run. 0 if unknown."""
        self._seen.append((now_s, end_s))
        while now_s - self._seen[0][0] > RTF_OVER_S:
            self._seen.popleft()
        wall_s = now_s - self._seen[0][0]
        return (end_s - self._seen[0][1]) / wall_s if wall_s > 0 else 0.0


def flown_rtf(folder: Path) -> float:
    """Real-time factor from the summary of a finished run; 0 if it has none."""
    try:
        return float(json.loads((folder / "summary.json").read_text())["rtf"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0.0


def look_from(server: viser.ViserServer, ground: TrueGround, here: F64) -> None:
    """Set a browser's first view: from behind and above a place (3,), towards the goal."""
    goal = np.array([*ground.goal_m, here[2]])
    ahead = (goal - here) / max(float(np.linalg.norm(goal - here)), 1e-6)
    server.initial_camera.position = tuple(here - BACK_M * ahead + (0.0, 0.0, UP_M))
    server.initial_camera.look_at = tuple(here + 1.5 * ahead)
    server.initial_camera.fov = np.radians(55.0)


def serve(folder: Folder, port: int, ready: Callable[[str], None]) -> None:
    """Serve until Ctrl-C, which is raised again. Calls `ready` with the address. Raises PortInUseError, NoRunError."""
    watcher = Watcher(folder, open_server(port))
    try:
        ready(address(port))
        before_s = time.monotonic()
        while True:
            now_s = time.monotonic()
            watcher.step(now_s - before_s, now_s)
            before_s = now_s
            time.sleep(PERIOD_S)
    finally:
        watcher.close()
