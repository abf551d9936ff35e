"""Real hardware with emulated hardware: the flight program on the wall clock, missing devices emulated in real time.

    --lidar tty:/dev/ttyACM0        the scanner is real, wheels and ground are the bench's
    --can socketcan:can0            the nodes are real; the bench only listens, and moves its rover by the commands on
                                    the bus, so that its scanner sees the ground pass
    neither                         all emulated: as `hil sim`, but nothing waits for anything

A mixed run does not repeat: a late process is late. Each run makes new link keys: bench keys are refused together with
a real device.
"""

from __future__ import annotations

import os
import secrets
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from hil.devices.can.hub import CanHub
from hil.devices.can.socket import CanSocket
from hil.devices.lidar.server import LidarServer
from hil.processes import Processes, free_ports
from hil.run.folder import check, cleared
from hil.scenarios.model import Scenario, fitting_of, flight_settings, ground_of, paths_in, set_words
from hil.terrain import field_file
from hil.terrain.field import Field
from hil.world.fitting import Fitting
from hil.world.truth import Truth
from hil.world.world import NS, Progress, World
from onboard.config import Rover, load
from onboard.maps.gdem_file import to_npz
from protocol.conventions import TICK_NS
from protocol.link.datagrams import DOWNLINK_KEY_ID, KEY_DOWN, KEY_UP, format_keys

STATION = 1
BEHIND_NS = 5 * TICK_NS  # a bench that is later than this drops the lost time instead of catching up


@dataclass(frozen=True, slots=True)
class Real:
    """Addresses of real devices, as in the flight program's configuration; empty for an emulated device."""

    lidar: str = ""
    can: str = ""


class MixedBench(World):
    """World in real time. Raises NoInterfaceError if the named CAN interface cannot be opened."""

    def __init__(
        self,
        ground: Field,
        seed: int,
        rover: Rover,
        truth: Truth,
        real: Real,
        fitting: Fitting = Fitting(),  # noqa: B008
        soil: str = "nominal",
    ) -> None:
        super().__init__(ground, seed, rover, truth, soil=soil)
        self.fit(fitting)
        self._real = real
        self.bus = CanSocket(real.can) if real.can else CanHub()
        self.lidar_server = None if real.lidar else LidarServer("127.0.0.1")
        self._client = 0
        self.advance(TICK_NS)

    @property
    def addresses(self) -> dict[str, str]:
        """Addresses that the flight program opens: can.uri and lidar.address."""
        lidar = self.lidar_server.address if self.lidar_server else self._real.lidar
        return {"can.uri": self.bus.uri, "lidar.address": lidar}

    def step(self) -> None:
        """Run one tick: send the devices' output, then apply the received input."""
        self.tick += 1
        now_ns = self.tick * TICK_NS
        frames = self.frames()
        self.bus.poll()
        if not self._real.can:
            self.bus.write(frames)
        asked = self._serve_lidar()
        self.advance(now_ns + TICK_NS)
        self.hear(self.bus.read(now_ns + TICK_NS), asked, now_ns + TICK_NS)
        self.note(now_ns)

    def _serve_lidar(self) -> bytes:
        """Send the scanner's output to its client and return the client's requests."""
        server = self.lidar_server
        if server is None:
            self.lidar_says()
            return b""
        asked = server.poll()
        if server.epoch != self._client or not server.connected:
            if self.lidar_open:
                self.lidar_open = False
                self.lidar.disconnect()
            if server.connected:
                self.plug_in()
            self._client = server.epoch
        pieces = self.lidar_says()
        if pieces is None:
            server.disconnect()
            return b""
        for _, data in pieces:
            server.write(data)
        return asked

    def close(self) -> None:
        """Close ports, engine and the truth file."""
        self.bus.close()
        if self.lidar_server:
            self.lidar_server.close()
        self.free()


def run(bench: MixedBench, processes: Processes, tell: Callable[[Progress, float], None]) -> None:
    """Run in real time until Ctrl-C. Raises ProcessDiedError. Counts ticks that began more than one tick late."""
    begun_ns = shown_ns = time.monotonic_ns()
    while True:
        bench.step()
        left_ns = begun_ns + bench.tick * TICK_NS - time.monotonic_ns()
        bench.progress.overruns += left_ns < -TICK_NS
        if left_ns < -BEHIND_NS:
            begun_ns -= left_ns
        if left_ns > 0:
            time.sleep(left_ns / NS)
        now_ns = time.monotonic_ns()
        if now_ns - shown_ns > NS // 2:
            shown_ns = now_ns
            processes.check()
            tell(bench.progress, (now_ns - begun_ns) / NS)


def fly(scenario: Scenario, folder: Path, real: Real, tell: Callable[[Progress, float], None]) -> None:
    """Run bench, onboard and link until Ctrl-C. Writes a station file; each child writes FOLDER/NAME.log.

    Raises NoInterfaceError, ConfigError, ProcessDiedError with the child's last lines.
    """
    check(folder)
    ground = ground_of(scenario).field
    cleared(folder)  # an old state belongs to the old keys
    (folder / "field.npz").write_bytes(field_file.to_npz(ground))
    (folder / "gdem.npz").write_bytes(to_npz(ground.gdem))
    rover_side, ground_side = (f"tcp/127.0.0.1:{port}" for port in free_ports(2))
    up, down = write_keys(folder)
    state = folder / "state"
    sector_rad = load(None, flight_settings(scenario, ground.start)).scanning.sector_rad
    truth, fitting = Truth(folder / "truth.mcap"), fitting_of(scenario, sector_rad)
    bench = MixedBench(ground, scenario.seed, load().rover, truth, real, fitting, scenario.soil)
    with ExitStack() as stack:
        stack.callback(bench.close)
        processes = stack.enter_context(Processes(folder))
        processes.start(
            "link",
            "hil",
            [
                "link",
                "--profile",
                scenario.link,
                "--seed",
                str(scenario.seed),
                "--rover",
                rover_side,
                "--ground",
                ground_side,
            ],
        )
        settings = {
            **paths_in(folder, flight_settings(scenario, bench.start)),
            "link.bench_seed": -1,
            "link.endpoint": rover_side,
            "link.command_keys": str(up),
            "link.downlink_key": str(down),
            "state.folder": str(state),
            "mission.gdem": str(folder / "gdem.npz"),
            "record.path": str(folder / "onboard.mcap"),
            **bench.addresses,
        }
        processes.start("onboard", "onboard", ["run", *set_words(settings)])
        (folder / "ground.toml").write_text(
            f'endpoint = "{ground_side}"\ncommand_keys = "{up.name}"\ndownlink_key = "{down.name}"\n'
            'state = "ground"\narchive = "ground/archive.db"\n'
        )
        run(bench, processes, tell)


def write_keys(folder: Path) -> tuple[Path, Path]:
    """Write new command keys and a new downlink key for this run, readable by the owner alone."""
    up, down = folder / "command.keys", folder / "downlink.key"
    for path, direction, key_id in ((up, KEY_UP, STATION), (down, KEY_DOWN, DOWNLINK_KEY_ID)):
        path.unlink(missing_ok=True)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(format_keys(direction, {key_id: secrets.token_bytes(32)}))
    return up, down
