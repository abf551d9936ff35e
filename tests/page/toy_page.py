"""`ground serve` on a toy rover in real time, for tests with a browser: one process, ordered by lines on its stdin.

    python toy_page.py FOLDER PORT [LINK [STATE ...]]

LINK: seconds one way, or a profile of hil/link/profiles.toml. STATE: silent, deaf or closed from the start.

Orders: `silent on|off` (nothing comes down), `deaf on|off` (nothing goes up), `closed on|off`, `event NAME TEXT`,
`clock rate RATIO|jump S` (of the rover), `flood` (a product of 4 MB), `height_std` (the deviations), `scan RISE_M` (a
sweep over ground that is so much higher), `large` (maps of 40,000 and 250,000 cells), `freeze S` (the web server's loop
is blocked for so long).
"""

import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/ground")]

from ground.page.live.acknowledged import Acknowledged  # noqa: E402
from ground.page.live.link import Live  # noqa: E402
from ground.page.map.maps import Maps  # noqa: E402
from ground.page.server import application, listen, run  # noqa: E402
from ground.page.web.access import hosts_of, stored_tokens  # noqa: E402
from ground.page.web.guard import Gate  # noqa: E402
from ground.page.web.site import Site  # noqa: E402
from ground.station.settings import StationSettings  # noqa: E402
from ground.station.station import Station, StationError  # noqa: E402
from hil.link.impairment import Profile, both_directions, load_profile  # noqa: E402
from onboard.config import load  # noqa: E402
from onboard.planning.prediction import digest  # noqa: E402
from onboard.records import Gdem, Grid  # noqa: E402
from protocol.link.datagrams import bench_keys  # noqa: E402
from protocol.products import LdemProduct, MapGrid, encode_ldem  # noqa: E402
from protocol.products.height_std import HEIGHT_STD_CODEC, HeightStd, encode_height_std  # noqa: E402
from protocol.products.pose_map import PoseMap, encode_poses  # noqa: E402
from protocol.products.scan import SCAN_CODEC, ScanProduct, encode_scan  # noqa: E402
from tests.ground.toy_rover import TICK_NS, ToyRover  # noqa: E402

MORE = {
    "sigma_major_m": 0.4, "sigma_minor_m": 0.1, "sigma_axis_rad": 0.5236, "slip_ratio": 0.12,
    **{f"steer_ordered_{n}_rad": steer for n, steer in zip((1, 2, 3, 4), (0.6, -0.6, -0.4, 0.4))},
    **{f"rate_ordered_{n}_radps": rate for n, rate in zip((1, 2, 3, 4), (1.2, 1.2, 2.0, 2.0))},
}  # fmt: skip


def a_map(cells: int = 120) -> bytes:
    """A map of rolling ground with a wall that nobody stands on."""
    row, column = np.mgrid[0:cells, 0:cells]
    heights = (0.2 * np.sin(row / 15.0) * np.cos(column / 18.0)).astype(np.float32)
    heights[:20, :20] = np.nan
    freedom = np.full((8, cells, cells), 2, np.uint8)
    freedom[:, 40:80, 85:90] = 0
    freedom[:, :20, :20] = 1
    sets = np.where((freedom == 2).any(axis=0), 3, np.where((freedom == 0).any(axis=0), 2, 1)).astype(np.uint8)
    poses = PoseMap(freedom, (2.0, 1.0, 0.0), known=True, settings=digest(load()))
    return encode_ldem(LdemProduct(MapGrid(-3.95, -4.95, 0.1, cells, cells), heights, sets)) + encode_poses(poses)


def a_scan(end_ns: int, rise_m: float, lines: int = 240, beams: int = 300) -> bytes:
    """A sweep from the rover's place over even ground; it ended at `end_ns`."""
    tilt_rad, first_rad, line_ns = np.linspace(1.05, 0.05, lines), -1.13, 25_000_000
    down = np.sin(tilt_rad)[:, None] * np.cos(np.linspace(first_rad, -first_rad, beams))[None, :]
    ranges_m = (0.7 - rise_m) / np.maximum(down, 0.02)
    status = (ranges_m > 8.0).astype(np.uint8)
    start_ns = max(0, end_ns - lines * line_ns) + line_ns * np.arange(lines, dtype=np.int64)
    mounting, place = np.eye(4), np.eye(4)
    mounting[2, 3], place[:2, 3] = 0.7, (0.0, 2.0)
    ranges_m = np.where(status == 0, ranges_m, np.nan).astype(np.float32)
    return encode_scan(
        ScanProduct(
            4, first_rad, -2 * first_rad / (beams - 1), ranges_m, status, start_ns, np.full(lines, 17361.1), start_ns,
            tilt_rad, place, mounting,
        )
    )  # fmt: skip


def profile_of(link: str) -> Profile:
    """A profile of the bench by its name, or a lossless link of so many seconds one way."""
    return load_profile(link) if not link[0].isdigit() else Profile(one_way_s=float(link), queue_s=60.0)


class Air:
    """The link and the rover beyond it, on the wall clock. Each process is a new boot of the rover.

    rate, jump_ns: onboard time is rate x bench time + jump_ns, as of a wrong clock.
    """

    def __init__(self, profile: Profile, boot_id: int) -> None:
        self.boot_id = boot_id
        self.rover = ToyRover(bench_keys(7), boot_id=boot_id, rate_bps=profile.down_bps, drive_s=4.0)
        self.rover.map, self.rover.fails = a_map(), False
        self.rover.more_items = dict(MORE)
        self.silent = self.deaf = self.closed = False
        self.rate, self.jump_ns = 1.0, 0
        self._down, self._up = both_directions(profile, 1)
        self._zero_ns, self._tick_ns = time.monotonic_ns(), 0
        self._lock = threading.Lock()

    @property
    def onboard_ns(self) -> int:
        return round(self._tick_ns * self.rate) + self.jump_ns

    def go_on(self) -> int:
        """Tick the rover up to now; return the time, ns."""
        now_ns = time.monotonic_ns() - self._zero_ns
        while self._tick_ns + TICK_NS <= now_ns:
            self._tick_ns += TICK_NS
            for datagram in self._up.due(self._tick_ns):
                self.rover.receive(datagram, self.onboard_ns)
            for datagram in self.rover.tick(self.onboard_ns):
                self._down.offer(datagram, self._tick_ns)
        return now_ns

    def take(self) -> list[bytes]:
        with self._lock:
            due = self._down.due(self.go_on())
            return [] if self.silent else due

    def put(self, datagram: bytes) -> None:
        with self._lock:
            now_ns = self.go_on()
            if not self.deaf:
                self._up.offer(datagram, now_ns)

    def offer(self, name: str, make: Callable[[int], bytes], codec: str) -> None:
        """Send a product down. make: called with onboard time, ns."""
        with self._lock:
            self.go_on()
            self.rover._bulk.offer(name, make(self.onboard_ns), codec, self.onboard_ns)

    def event(self, name: str, text: str) -> None:
        with self._lock:
            self.go_on()
            self.rover.event(self.onboard_ns, name, text)


def deviations(_now_ns: int) -> bytes:
    std_m = np.geomspace(0.002, 0.2, 120, dtype=np.float32) * np.ones((120, 1), np.float32)
    return encode_height_std(HeightStd(MapGrid(-3.95, -4.95, 0.1, 120, 120), std_m))


def flood(_now_ns: int) -> bytes:
    return np.random.default_rng(2).integers(0, 256, 4_000_000, dtype=np.uint8).tobytes()


class ToyEnd:
    """Link end that Station uses."""

    sends_unasked = False

    def __init__(self, air: Air) -> None:
        self._air = air

    @property
    def linked(self) -> bool:
        return not self._air.closed

    def wait_open(self, *_) -> bool:
        return self.linked

    def take(self, _most: int) -> list[bytes]:
        return self._air.take()

    def put(self, datagram: bytes) -> None:
        self._air.put(datagram)

    def close(self) -> None:
        pass


def large_gdem() -> Gdem:
    row, column = np.mgrid[0:500, 0:500]
    return Gdem(Grid(-50.0, -50.0, 0.2, 500, 500), np.sin(row / 40.0 + column / 60.0).astype(np.float32))


def orders(air: Air, maps: Maps, freeze: list[float]) -> None:
    for line in sys.stdin:
        verb, _, rest = line.strip().partition(" ")
        if verb in ("silent", "deaf", "closed"):
            setattr(air, verb, rest == "on")
        elif verb == "event":
            air.event(*rest.split(" ", 1))
        elif verb == "clock":
            kind, amount = rest.split()
            air.rate, air.jump_ns = (float(amount), 0) if kind == "rate" else (1.0, round(float(amount) * 1e9))
        elif verb == "flood":
            air.offer("scan", flood, "flood-1")
        elif verb == "height_std":
            air.offer("height_std", deviations, HEIGHT_STD_CODEC)
        elif verb == "scan":
            air.offer("scan", lambda end_ns: a_scan(end_ns, float(rest)), SCAN_CODEC)  # noqa: B023 - called at once
        elif verb == "large":
            air.rover.map, maps.gdem = a_map(200), large_gdem()
        elif verb == "freeze":
            freeze.append(float(rest))
        print(f"done {line.strip()}", flush=True)


def main() -> None:
    folder, port = Path(sys.argv[1]), int(sys.argv[2])
    boots = folder / "boots"
    boot_id = int(boots.read_text()) + 1 if boots.exists() else 1
    boots.write_text(str(boot_id))
    air = Air(profile_of(sys.argv[3] if len(sys.argv) > 3 else "0.1"), boot_id)
    for state in sys.argv[4:]:
        setattr(air, state, True)
    settings = StationSettings(bench_seed=7, state=str(folder), archive=str(folder / "archive.db"))

    class ToyStation(Station):
        def _opened(self, endpoint):
            if air.closed:
                raise StationError("no link: the toy's carrier is closed")
            return ToyEnd(air)

    maps = Maps(None, Path(settings.archive))
    maps.load()
    live = Live(settings, maps.add, ToyStation)
    tokens = stored_tokens(folder / "page-tokens.json")
    site = Site(
        Gate(tokens, hosts_of("127.0.0.1", port), port),
        live,
        maps,
        Acknowledged(folder / "seen.json"),
        settings.archive,
    )
    freeze: list[float] = []
    threading.Thread(target=orders, args=(air, maps, freeze), daemon=True).start()
    with listen("127.0.0.1", port) as at:
        made = application(site)
        live.start()
        print("ready", flush=True)
        try:
            run(made, at)
        finally:
            live.stop()


if __name__ == "__main__":
    main()
