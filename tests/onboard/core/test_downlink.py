"""The onboard end of the link, in virtual time."""

import math

import numpy as np
import pytest

from onboard.config import Link
from onboard.core.downlink import Downlink
from onboard.core.telemetry import SAMPLERS, TelemetryInputs
from onboard.devices.lidar.clock import ClockQuality
from onboard.records import (
    Estimate,
    Event,
    LinkMessage,
    Pose,
    PowerState,
    WheelCommand,
    WheelMode,
    WheelState,
)
from protocol.generated import eldorado_dialect
from protocol.link import bulk, events
from protocol.link import datagrams as link
from protocol.link.datagrams import DatagramKind
from protocol.link.transactions import RequestState, decode_report
from protocol.tables import commands, telemetry
from protocol.tables.modes import Mode, Phase

MS = 1_000_000
S = 1000 * MS
POSE = Pose(3.0, 4.0, 0.5, 0.01, -0.02, 0.3)
VIEW = TelemetryInputs(
    mode=Mode.AUTONOMOUS,
    phase=Phase.DRIVING,
    estimate=Estimate(POSE, np.diag([0.01, 0.03, 0.0, 0.0004]), 0.11, 0.05),
    goal_m=(6.0, 8.0),
    stop=3,
    wheels=tuple(WheelState(0.1 * n, 9.0, 0.5 * n, n, 0) for n in (1, 2, 3, 4)),
    power=PowerState(25.25, 3.5, 0.87, 21.0, 0),
    fault_ids=(0, 5, 63),
    wheel_orders=tuple(WheelCommand(WheelMode.RUN, 0.2 * n, 0.6 * n) for n in (1, 2, 3, 4)),
    slip_ratio=0.125,
    lidar_good=1000,
    lidar_bad=2,
    lidar_clock=ClockQuality(-5_009_990_280, -81.5, 4962.2, 400, 1, 2),
    tick_worst_ms=4.5,
    link_received=17,
    link_refused=1,
    events_waiting=2,
    job="map",
    job_ratio=0.25,
)


def uplink(name, arguments=None, request_id=1, expiry_ns=0, station=1):
    payload = commands.encode(commands.Telecommand(request_id, 0, expiry_ns, name, arguments or {}))
    return LinkMessage(0, True, "", station, DatagramKind.TELECOMMAND, payload)


def downlink(rate_bps=256e3, view=VIEW):
    made = Downlink(Link(rate_bps=rate_bps))
    made.sample(view, 0)
    made.send(0)
    return made


def decode(payloads):
    """MAVLink messages of all payloads."""
    parser = eldorado_dialect.MAVLink(None)
    return [m for kind, p in payloads if kind == DatagramKind.MAVLINK for m in parser.parse_buffer(p) or []]


def reports(payloads):
    return [decode_report(p) for kind, p in payloads if kind == DatagramKind.REPORT]


def run(made, until_ns, start_ns=0, view=VIEW, sampled=True):
    out = []
    for now_ns in range(start_ns, until_ns, 10 * MS):
        if sampled:
            made.sample(view, now_ns)
        out += [(now_ns, kind, payload) for kind, payload in made.send(now_ns)]
    return out


def test_an_order_comes_out_once_however_often_its_telecommand_arrives():
    made = downlink()
    goto = uplink("goto", {"x_m": 5.0, "y_m": 6.0})
    (order,) = made.receive([goto, goto], 10 * MS)
    assert (order.name, order.arguments, order.station) == ("goto", {"x_m": 5.0, "y_m": 6.0}, 1)
    assert made.receive([goto], 1 * S) == []
    made.report(order.request_id, RequestState.STARTED, "scanning", (12.5,))
    assert reports(made.send(1 * S))[-1][3:] == (RequestState.STARTED, 0, "scanning", (12.5,))


@pytest.mark.parametrize(
    ("message", "mode", "words"),
    [
        (uplink("goto", {"x_m": 1.0, "y_m": 1.0}), Mode.SAFE, "goto is refused in SAFE: it needs STANDBY"),
        (uplink("resume"), Mode.STANDBY, "resume is refused in STANDBY: it needs SAFE"),
        (uplink("stop", expiry_ns=1 * S), Mode.STANDBY, "stop arrived 1.0 s after its expiry"),
    ],
)
def test_what_may_not_be_done_is_reported_with_the_reason(message, mode, words):
    made = downlink(view=TelemetryInputs(mode=mode))
    assert made.receive([message], 2 * S) == []
    assert reports(made.send(2 * S))[0].text.startswith(words)


def test_every_item_of_the_table_arrives_as_its_sampler_gave_it():
    made = Downlink(Link())
    made.sample(VIEW, 5 * S)
    read = {}
    for message in decode(made.send(5 * S)):
        read |= telemetry.values(message)
    assert set(read) == {row.name for row in telemetry.TABLE}
    for name, value in read.items():
        assert value == pytest.approx(SAMPLERS[name](VIEW), rel=1e-6, abs=1e-6, nan_ok=True), name
    assert read["goal_distance_m"] == 5.0
    assert read["faults"] == 1 + 2**5 + 2**63


@pytest.mark.parametrize(("major_m", "minor_m", "axis_deg"), [(0.2, 0.05, 30.0), (0.3, 0.1, -60.0), (0.4, 0.0, 89.0)])
def test_the_ellipse_of_the_place_has_the_axes_of_the_covariance_that_was_turned(major_m, minor_m, axis_deg):
    c, s = math.cos(math.radians(axis_deg)), math.sin(math.radians(axis_deg))
    turn = np.array([[c, -s], [s, c]])
    covariance = np.diag([0.0, 0.0, 0.1, 0.1])
    covariance[:2, :2] = turn @ np.diag([major_m**2, minor_m**2]) @ turn.T
    view = TelemetryInputs(estimate=Estimate(POSE, covariance, 0.0, 0.0))
    found = [SAMPLERS[name](view) for name in ("sigma_major_m", "sigma_minor_m", "sigma_axis_rad")]
    assert found == pytest.approx([major_m, minor_m, math.radians(axis_deg)], abs=1e-7)


def test_mavlink_clients_read_position_north_and_down_and_heading_from_north():
    made = Downlink(Link())
    made.sample(VIEW, 0)
    found = {m.get_type(): m for m in decode(made.send(0))}
    position, attitude = found["LOCAL_POSITION_NED"], found["ATTITUDE"]
    assert (position.x, position.y, position.z) == (4.0, 3.0, -0.5)
    assert math.hypot(position.vx, position.vy) == pytest.approx(0.11)
    assert (attitude.roll, attitude.pitch) == pytest.approx((0.01, 0.02))
    assert (attitude.yaw, attitude.yawspeed) == pytest.approx((math.pi / 2 - 0.3, -0.05))
    assert found["HEARTBEAT"].custom_mode == Mode.AUTONOMOUS << 8 | Phase.DRIVING
    assert found["SYS_STATUS"].voltage_battery == 25250


def test_a_view_without_any_source_is_telemetry_all_the_same():
    made = Downlink(Link())
    made.sample(TelemetryInputs(), 0)
    assert {m.get_type() for m in decode(made.send(0))} == {"HEARTBEAT", "ROVER_STATE", "WHEELS", "ITEMS", "LINK_STATE"}


@pytest.mark.parametrize("rate_bps", [16e3, 64e3, 256e3])
def test_housekeeping_keeps_its_rates_and_no_more_than_93_percent_of_the_line_is_used_during_bulk(rate_bps):
    made = Downlink(Link(rate_bps=rate_bps))
    made.offer("ldem", np.random.default_rng(1).bytes(60_000), "ldem-1")
    sent = run(made, 8 * S)
    states = [t for t, kind, p in sent for m in decode([(kind, p)]) if m.get_type() == "ROVER_STATE"]
    assert len(states) == 16
    waits = [t - n * 500 * MS for n, t in enumerate(states)]
    assert max(waits) <= 300 * MS
    used = sum(link.line_bytes(len(p)) for _, _, p in sent)
    assert 0.88 * rate_bps / 8 * 8 <= used <= 0.93 * rate_bps / 8 * 8 + 2 * 1178
    assert max(len(p) for _, _, p in sent) + link.OVERHEAD <= link.datagram_limit(rate_bps)
    assert made.sent_bytes == used


def test_reports_go_before_housekeeping_and_that_before_events_and_bulk():
    made = Downlink(Link(rate_bps=16e3))
    made.receive([uplink("stop")], 0)
    made.offer("ldem", bytes(1000), "ldem-1")
    made.event(Event(0, "info", "NOTE", "hello"))
    sent = run(made, 2 * S)
    names = [
        "REPORT"
        if k == DatagramKind.REPORT
        else "BULK"
        if k == DatagramKind.BULK_CHUNK
        else "EVENT"
        if any(m.get_type() == "EVENT" for m in decode([(k, p)]))
        else "STATE"
        for _, k, p in sent
    ]
    order = list(dict.fromkeys(names))
    assert order == ["REPORT", "STATE", "EVENT", "BULK"]


def test_telemetry_that_waited_is_replaced_by_the_newest():
    made = Downlink(Link(rate_bps=16e3))
    for n in range(5):
        made.sample(TelemetryInputs(stop=n), n * 500 * MS)
    sent = [m for t in range(100) for m in decode(made.send(2 * S + t * 10 * MS))]
    assert [m.stop for m in sent if m.get_type() == "ROVER_STATE"] == [4]


def test_events_are_repeated_until_acknowledged_and_complete_after_a_blackout():
    made, ground = downlink(), events.EventReceiver()
    for n in range(40):
        made.event(Event(0, "warning", "FAULT", f"number {n} ü"))
    run(made, 60 * S, sampled=False)  # all lost
    made.receive([uplink("status")], 1 * S)
    made.receive([uplink("status")], 61 * S)  # contact is back
    found = {}
    for _, kind, payload in run(made, 63 * S, 61 * S, sampled=False):
        for message in decode([(kind, payload)]):
            ground.receive(message.serial)
            found[message.serial] = events.texts(message)
    assert found == {n + 1: ("FAULT", f"number {n} ü") for n in range(40)}
    (ack,) = ground.send(63 * S)
    made.receive([LinkMessage(0, True, "", 1, DatagramKind.REPORT, ack)], 64 * S)
    assert made.events_waiting == 0
    assert run(made, 130 * S, 64 * S, sampled=False) == []


def test_an_object_reaches_the_ground_and_its_bitmap_ends_it():
    made, ground, data = downlink(), bulk.Receiver(1000), bytes(range(256)) * 40
    made.offer("ldem", data, "ldem-1")
    (product,) = [p for _, k, c in run(made, 1 * S) if k == DatagramKind.BULK_CHUNK and (p := ground.receive(c, 0))]
    assert (product.name, product.data) == ("ldem", data)
    made.receive([LinkMessage(0, True, "", 1, DatagramKind.BULK_BITMAP, ground.send(0)[0])], 1 * S)
    assert not [k for _, k, _ in run(made, 5 * S, 1 * S) if k == DatagramKind.BULK_CHUNK]


def test_refused_datagrams_are_counted_by_kind_told_at_most_every_10_s_and_are_no_contact():
    made = downlink()
    bad = [LinkMessage(0, False, verdict, 0, 0, b"") for verdict in ("tag", "tag", "replay")]
    for n in range(200):
        made.receive(bad, n * 10 * MS)
    made.receive(
        [LinkMessage(0, True, "", 1, DatagramKind.TELECOMMAND, b"x"), LinkMessage(0, True, "", 1, 77, b"")], 3 * S
    )
    assert made.refused == {"tag": 400, "replay": 200, "telecommand": 1, "kind": 1}
    assert [event.text for event in made.notices] == ["replay 1, tag 2"]
    assert made.last_contact_ns == 3 * S
    made.receive(bad, 4 * S)
    assert made.last_contact_ns == 3 * S


def test_the_same_calls_give_the_same_bytes_and_digest():
    def once():
        made = downlink()
        made.receive([uplink("stop")], 0)
        made.offer("ldem", bytes(5000), "ldem-1")
        made.event(Event(0, "info", "NOTE", "a"))
        return run(made, 3 * S), made.digest_items()

    assert once() == once()
