"""hokuyolx, a public driver that is not ours, as a client of the emulated sensor over real TCP.

It believes nothing but the standard: sums, echoes, the states of %ST. One read of it must not hold the end of one frame
and the beginning of the next, so the sensor's time goes on only while it waits for bytes and has read all that were
sent: the same run every time, on a busy machine too.
"""

import dataclasses
import threading
import time

import numpy as np
import pytest

from hil.devices.lidar.profile import UTM30LX, UTM30LX_EW
from hil.devices.lidar.scenes import SCENES, still
from hil.devices.lidar.sensor import Lidar
from hil.devices.lidar.server import LidarServer
from hil.devices.lidar.service import Outlet, serve

pytest.importorskip("hokuyolx", reason="hokuyolx is not installed: `make test` brings it")
from hokuyolx import HokuyoLX
from hokuyolx.exceptions import HokuyoException, HokuyoStatusException

MS = 1_000_000
ROOM = still(SCENES["room"]())


class Running:
    """The emulator in a thread; its clock counts milliseconds in which the client had nothing to do but wait."""

    def __init__(self, profile):
        self.server, self.sensor = LidarServer(), Lidar(3, ROOM, profile)
        self.outlet = Outlet(self.sensor, self.server)
        self.news = threading.Condition()
        self.sent = self.read = 0  # by the client
        self.waiting = self.stopped = False
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        with self.news:
            self.stopped = True
            self.news.notify()
        self._thread.join(10.0)
        self.server.close()

    def _run(self):
        now_ns = 0
        while True:
            with self.news:
                self.news.wait_for(lambda: self.stopped or (self.waiting and self.server.sent <= self.read))
                if self.stopped:
                    return
            if self.server.received >= self.sent:
                now_ns += MS
            self.outlet.step(now_ns)

    def client(self):
        """A client that counts; only one."""
        made = HokuyoLX(
            addr=(self.server.host, self.server.port), activate=False, info=False, tsync=False, convert_time=False
        )
        self.server.wait_client(5.0)
        made._sock = Counted(made._sock, self)
        made.update_info()
        return made


class Counted:
    """The client's socket; says when it waits and how much it has read."""

    def __init__(self, wrapped, running):
        self._wrapped, self._running = wrapped, running

    def send(self, data):
        size = self._wrapped.send(data)
        self._running.sent += size
        return size

    def recv(self, size):
        running = self._running
        with running.news:
            running.waiting = True
            running.news.notify()
        data = self._wrapped.recv(size)
        with running.news:
            running.waiting = False
            running.read += len(data)
        return data

    def close(self):
        self._wrapped.close()


@pytest.fixture
def running():
    with Running(UTM30LX_EW) as made:
        yield made


@pytest.fixture
def laser(running):
    made = running.client()
    made.activate()
    yield made
    made.standby()
    made.close()


def test_it_connects_and_reads_what_the_sensor_is(laser):
    assert laser.model == "UTM-30LX-EW" and (laser.ares, laser.aforw, laser.scan_freq) == (1440, 540, 40)
    assert laser.version()["PROT"] == "SCIP 2.2"
    assert len(laser.sensor_state()) == 7 and laser.sensor_state()["STAT"] == "Stable 000 no error."
    assert laser.laser_state() == (3, "Single scan state")
    assert laser.activate()[0] == 2


def test_single_scans_are_the_room(laser):
    stamp, scan = laser.get_dist()
    assert scan.shape == (1081,) and stamp > 0
    assert abs(int(scan[180]) - 3000) < 120  # right: the wall 3 m away
    assert scan[540 + 4 * 2] == 1  # 2 degrees to the left: through the door, nothing there
    assert len(laser.get_dist(grouping=3)[1]) == 361 and len(laser.get_dist(start=500, end=600)[1]) == 101
    stamp, pairs = laser.get_intens()
    assert pairs.shape == (1081, 2) and (pairs[pairs[:, 0] > 22, 1] > 0).all()
    assert np.median(np.abs(pairs[:, 0].astype(int) - scan)) < 100


def test_continuous_scans_count_down_and_their_stamps_are_a_turn_apart(laser):
    scans = list(laser.iter_dist(scans=20))
    assert [pending for _, _, pending in scans] == list(range(19, -1, -1))
    stamps = np.array([stamp for _, stamp, _ in scans])
    assert set(np.diff(stamps)) <= {25, 26} and stamps[-1] - stamps[0] == pytest.approx(19 * 25.05, abs=1)


def test_intensity_streams_and_skips(laser):
    scans = list(laser.iter_intens(scans=4, skips=2))
    assert [scan.shape for scan, _, _ in scans] == [(1081, 2)] * 4
    assert set(np.diff([stamp for _, stamp, _ in scans])) <= {75, 76}


def test_an_endless_stream_ends_with_standby(laser):
    stream = laser.iter_dist()
    for _ in range(3):
        next(stream)
    laser.standby()
    assert laser.laser_state() == (0, "Standby state")
    assert laser.activate()[0] == 0


def test_its_clock_call_finds_when_the_counter_was_zero():
    """On the wall clock, as the client's own; the answer may be late, never early."""
    server, stop = LidarServer(), threading.Event()
    sensor = Lidar(3, ROOM, UTM30LX_EW)
    outlets = [Outlet(sensor, server)]
    begun_ms = time.time() * 1e3
    thread = threading.Thread(target=serve, args=(outlets, lambda now_ns: not stop.is_set()))
    thread.start()
    try:
        laser = HokuyoLX(addr=(server.host, server.port), tsync=False)
        laser.time_sync(N=5, dt=0)
        assert begun_ms - 2 < laser.tzero < time.time() * 1e3 and laser.laser_state()[0] == 0
        laser.close()
    finally:
        stop.set()
        thread.join(10.0)
        server.close()


def test_sleep_and_reset_are_understood(running):
    laser = running.client()
    laser.sleep()
    assert laser.laser_state() == (5, "Sleep state")
    laser.standby()
    while (state := laser.laser_state()[0]) != 0:
        assert state == 6  # waking
    laser.reset()
    laser.close()


def test_its_checks_find_what_the_faults_break(running):
    laser = running.client()
    running.sensor.faults.begin(running.sensor, "flip", "0.002")
    with pytest.raises((HokuyoException, UnicodeDecodeError, ValueError)):
        for _ in laser.iter_dist(scans=50):
            pass
    running.sensor.faults.end(running.sensor, "flip")
    laser.close()


def test_stamps_go_on_through_the_wrap_of_the_counter():
    with Running(dataclasses.replace(UTM30LX_EW, start_ms=2**24 - 400)) as near:
        laser = near.client()
        stamps = np.array([stamp for _, stamp, _ in laser.iter_dist(scans=30)])
        laser.close()
    steps = np.diff(stamps)
    assert (steps < 0).sum() == 1 and set(steps % 2**24) <= {25, 26}


def test_the_usb_sensor_lacks_its_state_command_and_all_else_works():
    with Running(dataclasses.replace(UTM30LX, reply_tick_ns=1_000_000)) as usb:
        laser = usb.client()
        with pytest.raises(HokuyoStatusException, match="CommandNotDefined"):
            laser.laser_state()
        assert [len(scan) for scan, _, _ in laser.iter_dist(scans=3)] == [1081] * 3
        laser.close()
