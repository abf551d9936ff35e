"""The rover's link port against a carrier of the test's own: probe, seal, open, stamps, keys."""

import socket
from contextlib import contextmanager

import pytest
import zenoh

from onboard.config import ConfigError, load
from onboard.drivers.link.port import LinkPort, LinkPortError, endpoint_of, link_keys
from onboard.records import PortState
from protocol.link import carrier
from protocol.link.datagrams import KEY_DOWN, KEY_UP, DatagramKind, Opener, Sealer, bench_keys, format_keys

KEYS = bench_keys(7)
SAFE = {"can.uri": "virtual:a", "lidar.address": "tcp:127.0.0.1:1"}


class Carrier:
    """Answers the rover's probes and keeps what it puts."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._in = session.declare_subscriber(KEY_DOWN, zenoh.handlers.FifoChannel(1000))
        question, answer = carrier.question_key(carrier.ROVER), carrier.answer_key(carrier.ROVER)

        def echo(sample: zenoh.Sample) -> None:
            if sample.payload.to_bytes() != carrier.READY:
                self.put(sample.payload.to_bytes(), answer)

        self._questions = session.declare_subscriber(question, echo)

    def put(self, data: bytes, key: str = KEY_UP) -> None:
        self._session.put(key, data, congestion_control=zenoh.CongestionControl.BLOCK)

    def take(self, count: int) -> list[bytes]:
        return [self._in.recv().payload.to_bytes() for _ in range(count)]


@contextmanager
def linked(boot_id: int = 3):
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{s.getsockname()[1]}"
    config = zenoh.Config()
    for key, text in carrier.settings(listen=endpoint):
        config.insert_json5(key, text)
    with zenoh.open(config) as session, LinkPort(endpoint, KEYS, boot_id) as port:
        far = Carrier(session)
        port.wait_open(20.0)
        yield port, far


def ground_sealer(boot_id: int = 3) -> Sealer:
    return Sealer(KEYS.command.key(1), 1, boot_id)


def test_what_leaves_is_sealed_with_the_rovers_key_and_counted():
    with linked() as (port, far):
        assert port.state is PortState.OPEN
        port.write([(DatagramKind.REPORT, b"first"), (DatagramKind.MAVLINK, b"second")])
        assert port.sent == 2
        opener = Opener(KEYS.downlink)
        assert [(o.kind, o.payload) for o in map(opener.open, far.take(2))] == [
            (DatagramKind.REPORT, b"first"),
            (DatagramKind.MAVLINK, b"second"),
        ]
        assert opener.boot_id == 3


def test_lock_step_takes_exactly_what_is_counted_with_the_barriers_stamps():
    with linked() as (port, far):
        sealer = ground_sealer()
        for n in range(5):
            far.put(sealer.seal(DatagramKind.TELECOMMAND, b"%d" % n))
        first = port.read_upto(2, (10, 20))
        rest = port.read_upto(5, (30, 40, 50))
        assert [(m.rx_ns, m.payload, m.accepted, m.station, m.kind) for m in first + rest] == [
            ((n + 1) * 10_000, b"%d" % n, True, 1, DatagramKind.TELECOMMAND) for n in range(5)
        ]
        assert port.read_upto(5, ()) == ()


def test_refused_datagrams_are_handed_on_without_payload_and_with_the_failed_check():
    with linked() as (port, far):
        good = ground_sealer().seal(DatagramKind.TELECOMMAND, b"stop")
        far.put(good[:-1] + bytes([good[-1] ^ 1]))
        far.put(ground_sealer(boot_id=2).seal(DatagramKind.TELECOMMAND, b"stop"))
        far.put(b"noise")
        far.put(good)
        far.put(good)
        got = port.read_upto(5, (1, 2, 3, 4, 5))
        assert [(m.accepted, m.verdict, m.payload) for m in got] == [
            (False, "tag", b""),
            (False, "boot", b""),
            (False, "length", b""),
            (True, "ok", b"stop"),
            (False, "copy", b""),
        ]


def test_missing_datagrams_end_the_wait_with_their_number():
    with linked() as (port, _), pytest.raises(LinkPortError, match="0 of 1 datagrams"):
        port.read_upto(1, (1,), limit_s=0.0)


def test_without_a_carrier_the_port_stays_closed_and_writes_are_lost():
    with LinkPort("tcp/127.0.0.1:1", KEYS, 1) as port:
        port.write([(DatagramKind.REPORT, b"x")])
        assert port.read(0) == ()
        assert port.state is PortState.CLOSED
        with pytest.raises(LinkPortError, match="did not answer a probe"):
            port.wait_open(0.0)


def test_a_closed_port_is_in_error_and_takes_writes_silently():
    with linked() as (port, _):
        port.close()
        port.write([(DatagramKind.REPORT, b"x")])
        assert port.state is PortState.ERROR


def test_a_wrong_locator_is_a_configuration_error():
    with pytest.raises(ConfigError, match=r"link\.endpoint"):
        LinkPort("nonsense", KEYS, 1)


def key_files(tmp_path, mode: int = 0o600) -> dict[str, str]:
    up, down = tmp_path / "command.keys", tmp_path / "down.key"
    up.write_text(format_keys(KEY_UP, {1: b"u" * 32}))
    down.write_text(format_keys(KEY_DOWN, {0: b"d" * 32}))
    up.chmod(mode)
    down.chmod(0o600)
    return {"link.command_keys": str(up), "link.downlink_key": str(down), "state.folder": str(tmp_path / "state")}


def test_keys_come_from_the_named_files(tmp_path):
    keys = link_keys(load(overrides=key_files(tmp_path)))
    assert keys.command.key_ids == (1,)
    assert keys.downlink.key_ids == (0,)


def test_a_key_file_that_others_may_read_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"mode 0640.*chmod 600"):
        link_keys(load(overrides=key_files(tmp_path, 0o640)))


def test_swapped_key_files_are_refused(tmp_path):
    files = key_files(tmp_path)
    up, down = files["link.command_keys"], files["link.downlink_key"]
    swapped = files | {"link.command_keys": down, "link.downlink_key": up}
    with pytest.raises(ConfigError, match="holds keys of er2/d, should be of er2/u"):
        link_keys(load(overrides=swapped))


def test_a_missing_key_file_is_named(tmp_path):
    files = key_files(tmp_path) | {"link.downlink_key": str(tmp_path / "none")}
    with pytest.raises(ConfigError, match=r"link\.downlink_key: .*none: No such file"):
        link_keys(load(overrides=files))


@pytest.mark.parametrize("device", [{"can.uri": "socketcan:can0"}, {"lidar.address": "tty:/dev/ttyACM0"}])
def test_bench_keys_are_refused_with_a_real_device(device):
    with pytest.raises(ConfigError, match="bench keys are known to everybody"):
        link_keys(load(overrides=SAFE | {"link.bench_seed": 7} | device))


def test_bench_keys_come_from_the_seed_where_nothing_is_real():
    keys = link_keys(load(overrides=SAFE | {"link.bench_seed": 7}))
    assert keys.command.key(1) == KEYS.command.key(1)
    assert link_keys(load(overrides=SAFE | {"link.bench_seed": 0})).command.key(1) == bench_keys(0).command.key(1)


@pytest.mark.parametrize("endpoint", ["tcp/192.168.0.1:7447", "tcp/rover:7447", "tcp/0.0.0.0:7447"])
def test_a_zenoh_node_on_another_computer_is_taken_only_on_request(endpoint):
    with pytest.raises(ConfigError, match=r"link\.endpoint = .* is not on this computer"):
        endpoint_of(load(overrides={"link.endpoint": endpoint}))
    assert endpoint_of(load(overrides={"link.endpoint": endpoint, "link.remote_node": True})) == endpoint


@pytest.mark.parametrize("endpoint", ["tcp/127.0.0.1:7447", "tcp/[::1]:7447", "udp/0.0.0.0:7450", "udp/[::]:7450"])
def test_a_node_on_the_loopback_and_the_carrier_without_sessions_are_taken(endpoint):
    assert endpoint_of(load(overrides={"link.endpoint": endpoint})) == endpoint


def test_no_keys_at_all_is_refused():
    with pytest.raises(ConfigError, match="no key files named"):
        link_keys(load(overrides=SAFE))
