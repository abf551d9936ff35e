"""A short hunt of tests/fuzz/lidar.py; `make test-sanitize` hunts for two minutes."""

from hypothesis import settings

from hil.devices.lidar.faults import ScheduledFault
from hil.devices.lidar.profile import UTM30LX
from hil.devices.lidar.sensor import QUEUE_LIMIT
from tests.fuzz import lidar as fuzz_lidar

CALM = settings(max_examples=60, deadline=None, derandomize=True)


@CALM
@fuzz_lidar.profiles_and_talks
def test_any_request_is_answered_once_or_refused_however_it_is_cut(profile, talk):
    fuzz_lidar.check_talk(profile, talk)


@CALM
@fuzz_lidar.faults_and_talks
def test_no_fault_breaks_the_sensor_itself(talk, kinds):
    fuzz_lidar.check_faults(talk, kinds)


def test_a_flood_of_requests_between_two_reply_ticks_is_not_kept():
    sensor = fuzz_lidar.sensor_of(UTM30LX)
    for _ in range(100):
        sensor.receive(b"VV\n" * 20_000, 1)
    assert sensor._queued <= QUEUE_LIMIT + 1000
    sensor.step(30_000_000)
    assert sum(len(data) for _, data in sensor.send()) <= QUEUE_LIMIT + 1000 and sensor._queued == 0


def test_scans_that_will_never_leave_are_not_kept():
    sensor = fuzz_lidar.sensor_of(UTM30LX, ScheduledFault("slow", 0.0, value="1000000"))
    sensor.receive(b"MD0000108001000\n", 0)
    sensor.step(60_000_000_000)
    assert sensor._queued <= QUEUE_LIMIT + 4000 and sensor.pieces() == []
