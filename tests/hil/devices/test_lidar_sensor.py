"""The emulated sensor: what a client of the standard expects, the same bytes for the same seed, and real cables."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hil.devices.lidar import profile as profiles
from hil.devices.lidar import sensor
from hil.devices.lidar.server import LidarServer, LidarTerminal
from onboard.config import ConfigError
from onboard.config import Lidar as LidarConfig
from onboard.devices.lidar.session import LidarSession
from onboard.drivers.lidar.port import open_port
from onboard.records import Chunk, PortState
from protocol import scip
from tests.protocol.scip.test_scip import PP, VV


def flat(times_ns):
    return np.full(len(times_ns), 5.0)


def twin(profile=profiles.IDEAL, cast=flat, seed=7):
    made = sensor.Lidar(seed, cast, profile)
    made.connect()
    return made


def ask(device, line, now_ns=0):
    device.receive(line, now_ns)
    device.step(now_ns)
    return b"".join(data for _, data in device.send())


def scans_of(device, until_ns):
    device.step(until_ns)
    splitter = scip.Splitter()
    return [frame for t, data in device.send() for _, frame in splitter.receive(t, data)]


def test_text_replies_are_the_logged_bytes():
    assert ask(twin(), b"VV\n") == VV
    assert ask(twin(), b"PP\r\n") == PP


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        (b"QT\n", b"QT\n00P\n\n"),
        (b"CR00\n", b"CR00\n04T\n\n"),
        (b"SCIP2.0\n", b"SCIP2.0\n0Ee\n\n"),
        (b"%ST\n", b"%ST\n0Ee\n\n"),
        (b"BM\nBM\n", b"BM\n00P\n\nBM\n02R\n\n"),
        (b"GD0000108001\n", b"GD0000108001\n10Q\n\n"),
        (b"TM1\n", b"TM1\n04T\n\n"),
        (b"TM0\nTM0\nVV\nTM2\nTM2\n", b"TM0\n00P\n\nTM0\n02R\n\nVV\n10Q\n\nTM2\n00P\n\nTM2\n03S\n\n"),
        (b"MD0000108101000\n", b"MD0000108101000\n04T\n\n"),
        (b"QT;hello\n", b"QT;hello\n00P\n\n"),
        (b"\n\r\n", b""),
    ],
)
def test_replies_byte_for_byte(line, reply):
    assert ask(twin(), line) == reply
    device = twin()
    assert b"".join(ask(device, line[k : k + 1]) for k in range(len(line))) == reply


def test_state_reply_has_the_7_lines_of_the_log():
    lines = ask(twin(), b"II\n", 1_234_000_000).split(b"\n")
    assert [line.split(b":")[0] for line in lines[2:9]] == b"MODL LASR SCSP MESM SBPS TIME STAT".split()
    assert lines[7].startswith(b"TIME:0004D2;") and lines[9:] == [b"", b""]


def test_counted_stream_counts_down_then_the_laser_goes_off():
    device = twin()
    ask(device, b"MD0000108001003\n")
    frames = scans_of(device, 200_000_000)
    assert [frame[13:15] for frame in frames] == [b"02", b"01", b"00"]
    assert not device.laser_on and device.scans == 3


def test_endless_stream_skips_turns_and_stops_at_qt():
    device = twin()
    ask(device, b"MD0000108001100\n")
    frames = scans_of(device, 500_000_000)
    stamps = [scip.parse_stamp(frame.split(b"\n")[2]) for frame in frames]
    assert np.diff(stamps).tolist() == [50] * (len(frames) - 1)
    assert ask(device, b"QT\n", 510_000_000).endswith(b"QT\n00P\n\n")
    assert scans_of(device, 900_000_000) == []


def test_nothing_is_cast_while_nothing_is_asked():
    def never(times_ns):
        raise AssertionError

    device = twin(cast=never)
    device.step(10_000_000_000)
    assert device.send() == []


def test_every_beam_is_cast_at_its_own_time_once_the_sweep_has_ended():
    calls = []

    def cast(times_ns):
        calls.append(times_ns)
        return flat(times_ns)

    device = twin(cast=cast)
    ask(device, b"MD0000108001000\n", 1)
    device.step(43_000_000)
    assert not calls
    device.step(43_750_000)
    (times_ns,) = calls
    assert times_ns.dtype == np.int64 and times_ns[0] == 25_000_000
    assert times_ns[-1] - times_ns[0] == pytest.approx(18_750_000, abs=1)
    assert set(np.diff(times_ns)) == {17_361, 17_362} or set(np.diff(times_ns)) == {17_361}


def test_frame_leaves_1_ms_after_its_sweep_and_not_before():
    device = twin()
    ask(device, b"MD0000108001000\n")
    device.step(19_740_000)
    assert device.send() == []
    device.step(19_750_000)
    ((stamp_ns, data),) = device.send()
    assert stamp_ns == 19_750_000 and len(data) == 3372


def test_codes_noise_and_millimetre_steps():
    def cast(times_ns):
        ranges_m = np.full(1081, 5.0)
        ranges_m[:300], ranges_m[300:600] = 20.0, 0.09
        ranges_m[600:650], ranges_m[650:700] = np.inf, 30.5
        return ranges_m

    device = twin(cast=cast)
    ask(device, b"MD0000108001000\n")
    asked = scip.ScanRequest("MD", 0, 1080)
    rows = np.array([scip.parse_scan(scip.parse_reply(f), asked).values for f in scans_of(device, 1_000_000_000)])
    assert (rows[:, 300:600] == 2).all() and (rows[:, 600:700] == 1).all()
    assert rows[:, 700:].std() == pytest.approx(20, rel=0.05) and rows[:, :300].std() == pytest.approx(30, rel=0.05)
    assert abs(rows[:, 700:].mean() - 5000) < 1


def test_dropouts_take_their_share():
    device = twin(dataclasses.replace(profiles.IDEAL, dropout_ratio=0.1))
    ask(device, b"MD0000108001000\n")
    asked = scip.ScanRequest("MD", 0, 1080)
    rows = np.array([scip.parse_scan(scip.parse_reply(f), asked).values for f in scans_of(device, 1_000_000_000)])
    assert (rows == 1).mean() == pytest.approx(0.1, abs=0.01)


def test_clusters_keep_the_smallest_and_one_shot_scans_need_the_laser():
    device = twin(cast=lambda times_ns: np.linspace(1, 12, 1081))
    ask(device, b"BM\nGD0000107903\n")
    (frame,) = scans_of(device, 100_000_000)
    asked = scip.ScanRequest("GD", 0, 1079, 3)
    assert len(scip.parse_scan(scip.parse_reply(frame), asked).values) == 360


def test_own_clock_runs_fast_and_wraps():
    device = twin(dataclasses.replace(profiles.IDEAL, rate_error=1e-3, start_ms=2**24 - 1000.0))
    assert device.clock_ms(0) == 2**24 - 1000
    assert device.clock_ms(2_000_000_000) == 1002


def test_utm_30lx_answers_once_a_turn_and_sends_a_frame_in_three_bursts():
    device = twin(profiles.UTM30LX)
    device.receive(b"VV\nTM0\n", 3_000_000)
    device.step(60_000_000)
    assert [t for t, _ in device.send()] == [25_000_000, 25_000_000]
    device.receive(b"TM1\n", 60_000_000)
    device.step(61_000_000)
    assert [t for t, _ in device.send()] == [60_950_000]
    ask(device, b"TM2\nMD0000108001001\n", 70_000_000)
    device.step(200_000_000)
    pieces = [piece for piece in device.send() if piece[0] > 75_000_000]
    assert len(pieces) == 3 and sum(len(data) for _, data in pieces) == 3372
    assert 75_000_000 + 23_700_000 <= pieces[0][0] <= 75_000_000 + 25_500_000


@pytest.mark.parametrize("profile", [profiles.IDEAL, profiles.UTM30LX])
def test_same_seed_same_bytes(profile):
    def record(seed):
        device = twin(profile, seed=seed)
        device.receive(b"MD0000108001000\n", 0)
        out = []
        for tick in range(100):
            device.step(tick * 10_000_000)
            out += device.send()
        return out

    assert record(3) == record(3) != record(4)


def test_tcp_stream_dies_with_its_client_and_the_usb_stream_does_not():
    for profile, on in ((profiles.IDEAL, False), (profiles.UTM30LX, True)):
        device = twin(profile)
        ask(device, b"MD0000108001000\n")
        device.disconnect()
        device.connect()
        assert device.laser_on is on


# -- real cables -----------------------------------------------------------------------------------------------


def fly(server, port, session, first_tick, ticks):
    """The lock-step in small: each side counts its bytes, the other waits for as many."""
    device = sensor.Lidar(1, flat)
    scans, epoch = [], server.epoch
    for tick in range(first_tick, first_tick + ticks):
        now_ns = tick * 10_000_000
        received = server.poll_exactly(port.sent, 5.0) if server.connected else b""
        if server.epoch != epoch:
            epoch = server.epoch
            device.connect()
        device.receive(received, now_ns)
        device.step(now_ns)
        stamps = [(stamp_ns, server.write(data)) for stamp_ns, data in device.send()]
        data = port.read_exactly(server.sent, 5.0) if server.connected else b""
        assert len(data) == sum(size for _, size in stamps)
        chunks, at = [], 0
        for stamp_ns, size in stamps:
            chunks.append(Chunk(stamp_ns, data[at : at + size]))
            at += size
        scans += session.receive(chunks, port.state, now_ns)
        port.write(session.send(now_ns))
        if session.wants_connect(now_ns):
            port.connect()
            assert port.wait_open(5.0) is PortState.OPEN and server.wait_client(5.0)
    return scans


@pytest.mark.parametrize("make", [LidarServer, LidarTerminal])
def test_whole_round_trip_over_a_real_cable(make):
    server = make()
    port, session = open_port(server.address), LidarSession(LidarConfig())
    session.stream(True)
    try:
        scans = fly(server, port, session, 1, 100)
        assert len(scans) >= 30 and session.bad == 0 and session.counts["timeouts"] == 0
        server.disconnect()
        assert port.read_exactly(server.sent + 1, 5.0) == b"" and port.state is PortState.ERROR
        assert session.receive((), port.state, 10**9) == []
        server.poll()
        again = fly(server, port, session, 200, 300)
        assert len(again) > 30 and (server.epoch, port.epoch, session.counts["reconnects"]) == (2, 2, 1)
    finally:
        port.close()
        server.close()


def test_announced_bytes_that_never_come_are_a_timeout_that_says_so():
    server = LidarServer()
    port = open_port(server.address)
    port.connect()
    assert port.wait_open(5.0) is PortState.OPEN and server.wait_client(5.0)
    server.write(b"12345")
    assert port.read_exactly(3, 5.0) == b"123"
    with pytest.raises(TimeoutError, match=r"6 bytes were announced .* 5 came"):
        port.read_exactly(6, 0.0)
    assert port.read_exactly(5, 5.0) == b"45"
    with pytest.raises(TimeoutError, match="1 bytes were announced, 0 came"):
        server.poll_exactly(1, 0.0)
    port.close()
    server.close()


def test_refused_and_absent_ports_are_states_not_exceptions():
    server = LidarServer()
    port = open_port(server.address)
    server.refuse(True)
    port.connect()
    assert port.wait_open(5.0) is PortState.ERROR
    server.refuse(False)
    port.connect()
    assert port.wait_open(5.0) is PortState.OPEN and server.wait_client(5.0)
    port.close()
    server.close()
    terminal = open_port("tty:/dev/there-is-no-such-scanner")
    terminal.connect()
    assert terminal.state is PortState.ERROR and terminal.read(0) == ()


def test_clients_that_came_and_went_while_nobody_looked_do_not_block_the_next():
    server = LidarServer()
    for _ in range(30):
        port = open_port(server.address)
        port.connect()
        assert port.wait_open(5.0) is PortState.OPEN
        port.close()
    port = open_port(server.address)
    port.connect()
    assert port.wait_open(5.0) is PortState.OPEN
    port.write(b"VV\n")
    received = b""
    for _ in range(40):
        received += server.poll()
    assert received == b"VV\n" and server.connected
    port.close()
    server.close()


def test_second_client_waits_and_slow_reader_loses_whole_writes():
    server = LidarServer()
    port = open_port(server.address)
    port.connect()
    port.wait_open(5.0)
    server.poll()
    accepted = sum(server.write(b"x" * 3372) for _ in range(5000))
    assert server.dropped > 0 and accepted == 3372 * (5000 - server.dropped)
    port.close()
    server.close()


@pytest.mark.parametrize("address", ["tcp:host", "udp:host:1", "tty:ttyACM0", "tcp:h:99999", ""])
def test_bad_address_names_the_two_forms(address):
    with pytest.raises(ConfigError, match=r"tcp:HOST:PORT.*or tty:PATH"):
        open_port(address)


def test_a_motor_with_jitter_runs_from_time_0_and_each_turn_starts_within_its_jitter():
    profile = dataclasses.replace(profiles.IDEAL, motor_jitter_ns=30_000.0)
    turns = sensor.Turns(7, profile)
    assert [turns.ended(now_ns) for now_ns in (0, 10_000_000, 18_000_000)] == [-1, -1, -1]
    late_ns = np.array([turns.start_ns(turn) - turn * 25e6 for turn in range(4000)])
    assert late_ns.std() == pytest.approx(30_000.0, rel=0.05) and abs(late_ns.mean()) < 1_500.0
    assert [turns.start_ns(turn) - turn * 25e6 for turn in (3000, 0)] == late_ns[[3000, 0]].tolist()  # in any order
    device = twin(profile)
    assert ask(device, b"MD0000108001000\n") == b"MD0000108001000\n00P\n\n"
    assert len(scans_of(device, 500_000_000)) == 20
