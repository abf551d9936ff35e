"""Bench keys are known to everybody: they are taken only where no byte leaves this computer."""

import pytest

from onboard.config import ConfigError, load
from onboard.drivers.link.port import link_keys

BENCH = {
    "link.bench_seed": 7, "can.uri": "virtual:a", "lidar.address": "tcp:127.0.0.1:10940",
    "link.endpoint": "tcp/127.0.0.1:7447",
}  # fmt: skip


@pytest.mark.parametrize(("name", "place"), [
    ("can.uri", "socketcan:can0"),
    ("can.uri", "socketcan:vcan"),
    ("can.uri", "socketcan:vcan0x"),
    ("can.uri", "socketcand:192.168.0.4:29536/rover"),
    ("can.uri", "socketcand:gateway:29536/rover"),
    ("can.uri", "usb:1"),
    ("lidar.address", "tcp:192.168.0.10:10940"),
    ("lidar.address", "tcp:127.0.0.1.example.org:10940"),
    ("lidar.address", "tty:/dev/ttyACM0"),
    ("link.endpoint", "udp/0.0.0.0:7450"),
    ("link.endpoint", "udp/[::]:7450"),
    ("link.endpoint", "tcp/192.168.0.1:7447"),
    ("link.endpoint", "tcp/rover:7447"),
    ("link.endpoint", "tls/rover:7447"),
    ("link.endpoint", "tcp/127.0.0.1:7447;tcp/192.168.0.1:7447"),
])  # fmt: skip
def test_bench_keys_are_refused_where_one_address_leaves_the_computer(name, place):
    with pytest.raises(ConfigError, match="bench keys are known to everybody") as raised:
        link_keys(load(overrides=BENCH | {name: place}))
    assert f"{name} = {place!r}" in str(raised.value)


def test_bench_keys_are_refused_where_the_bench_is_on_another_computer():
    far = {"clock.mode": "lockstep", "clock.barrier": "tcp:192.168.0.1:7000"}
    with pytest.raises(ConfigError, match=r"refused with clock\.barrier"):
        link_keys(load(overrides=BENCH | far))
    assert link_keys(load(overrides=BENCH | far | {"clock.barrier": "tcp:127.0.0.1:7000"})).command.key_ids


@pytest.mark.parametrize(("name", "place"), [
    ("can.uri", "socketcan:vcan0"),
    ("can.uri", "socketcand:localhost:29536/rover"),
    ("can.uri", "socketcand:127.0.0.2:29536/rover"),
    ("lidar.address", "tcp:localhost:10940"),
    ("lidar.address", "tcp:[::1]:10940"),
    ("link.endpoint", "udp/127.0.0.1:7450"),
    ("link.endpoint", "tcp/[::1]:7447"),
    ("link.endpoint", "tcp/localhost:7447"),
])  # fmt: skip
def test_bench_keys_are_taken_on_loopback_and_in_memory(name, place):
    assert link_keys(load(overrides=BENCH | {name: place})).command.key_ids
