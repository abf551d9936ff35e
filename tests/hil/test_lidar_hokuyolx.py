"""hokuyolx, a public driver that is not ours, as a client of the emulated sensor over real TCP.

It believes nothing but the standard: sums, echoes, the seven states of %ST. Only its clock call sleeps; dt=0 here.
"""

import dataclasses
import threading

import numpy as np
import pytest
from hokuyolx import HokuyoLX
from hokuyolx.exceptions import HokuyoException, HokuyoStatusException

from hil.devices.lidar import Lidar
from hil.devices.lidar_profile import UTM30LX, UTM30LX_EW
from hil.lidar_server import LidarServer
from hil.lidar_service import Outlet, serve
from hil.scenes import SCENES, still


class Running:
    """The emulator's loop in a thread, as `hil lidar` runs it."""

    def __init__(self, profile, scene="room"):
        self.server, self._stop = LidarServer(), threading.Event()
        self.sensor = Lidar(3, still(SCENES[scene]()), profile)
        outlet = Outlet(self.sensor, self.server)
        self._thread = threading.Thread(target=serve, args=([outlet], lambda now_ns: not self._stop.is_set()))

    def __enter__(self):
        self._thread.start()
        return self

    def client(self, **settings):
        return HokuyoLX(addr=(self.server.host, self.server.port), tsync=False, **settings)

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join(10.0)
        self.server.close()


@pytest.fixture(scope="module")
def running():
    with Running(UTM30LX_EW) as made:
        yield made


@pytest.fixture
def laser(running):
    made = running.client(convert_time=False)
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


def test_its_clock_call_maps_stamps_to_its_own_time(running):
    laser = running.client()
    laser.time_sync(N=5, dt=0)
    assert laser.tzero > 0 and laser.laser_state()[0] == 0
    laser.activate()
    (first, _), (second, _) = laser.get_dist(), laser.get_dist()
    assert 0 <= second - first < 2_000
    laser.standby()
    laser.close()


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
    laser = running.client(convert_time=False)
    running.sensor.faults.begin(running.sensor, "flip", "0.002")
    with pytest.raises((HokuyoException, UnicodeDecodeError, ValueError)):
        for _ in laser.iter_dist(scans=50):
            pass
    running.sensor.faults.end(running.sensor, "flip")
    laser.close()


def test_stamps_go_on_through_the_wrap_of_the_counter():
    with Running(dataclasses.replace(UTM30LX_EW, start_ms=2**24 - 400)) as near:
        laser = near.client(convert_time=False)
        stamps = np.array([stamp for _, stamp, _ in laser.iter_dist(scans=30)])
        laser.close()
    steps = np.diff(stamps)
    assert (steps < 0).sum() == 1 and set(steps % 2**24) <= {25, 26}


def test_the_usb_sensor_lacks_its_state_command_and_all_else_works():
    with Running(dataclasses.replace(UTM30LX, reply_tick_ns=1_000_000)) as usb:
        laser = usb.client(convert_time=False)
        with pytest.raises(HokuyoStatusException, match="CommandNotDefined"):
            laser.laser_state()
        assert [len(scan) for scan, _, _ in laser.iter_dist(scans=3)] == [1081] * 3
        laser.close()
