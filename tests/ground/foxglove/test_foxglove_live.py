"""Live data for Foxglove: a WebSocket client that knows the published protocol alone reads poses, events, map, cloud.

Protocol foxglove.sdk.v1: the server sends serverInfo and advertise as JSON, the client subscribes with ids of its own,
and messages come as bytes: 1, subscription id (u32), time (u64 ns), payload; little-endian.
"""

import base64
import json
import math
import socket
import struct
import sys
from contextlib import contextmanager
from threading import Event

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from ground.__main__ import run
from ground.foxglove import shapes
from ground.foxglove.messages import CHANNELS, FRAMES, messages
from ground.foxglove.server import FoxgloveServer
from ground.link.news import EventHeard, Item, ProductHeard
from ground.page.live.link import Live
from ground.station.clock import ClockTurn
from ground.station.settings import StationSettings
from ground.station.station import StationError
from onboard.bringup.records.foxglove import VIEWS
from protocol.conventions import TICK_NS
from protocol.generated.can_codec import TABLE as CAN
from protocol.link.bulk import Product
from protocol.mavlink_frames import ned_angles
from protocol.products import decode_ldem
from protocol.products.scan import decode_scan, encode_scan
from protocol.tables.telemetry import TABLE
from tests.ground.virtual_station import S, VirtualClock, VirtualStation
from tests.protocol.products.test_scan_product import room

SUBPROTOCOL = "foxglove.sdk.v1"
ANGLES = (0.1, -0.2, 2.0)
_RECEIVE_S = 0.01


class World:
    """The server on a virtual station with a rover that tells its attitude, and one client."""

    def __init__(self, **station):
        self.station, self._clock = VirtualStation(**station), VirtualClock(1e6)
        rover = self.station.rover
        telemetry = rover._telemetry

        def with_attitude(now_ns):
            sent = rover._mavlink.attitude_encode(now_ns // 1_000_000, *ned_angles(*ANGLES), 0.0, 0.0, 0.0)
            return telemetry(now_ns) + sent.pack(rover._mavlink)

        rover._telemetry = with_attitude
        self.server = FoxgloveServer("127.0.0.1", 0)
        self.now_ns = 0

    def __enter__(self):
        self.server.__enter__()
        return self

    def __exit__(self, *error):
        self.server.__exit__(*error)

    def turn(self, news=()):
        turn = self._clock.turn(0, None)
        self.now_ns = turn.now_ns
        self.server.turn([*self.station.turn(turn), *news], self.station.session, turn.now_ns)
        self.station.flush(turn.now_ns)


class Viewer:
    """A client of the published protocol."""

    def __init__(self, port):
        self.peer = connect(f"ws://127.0.0.1:{port}", subprotocols=[SUBPROTOCOL], max_size=1 << 26)
        self.channels, self.words = {}, []
        self.got = []  # (topic, time ns, payload)

    def receive(self, timeout=_RECEIVE_S):
        try:
            data = self.peer.recv(timeout=timeout)
        except TimeoutError:
            return
        if isinstance(data, bytes):
            code, subscription, at_ns = struct.unpack_from("<BIQ", data)
            if code == 1:
                topic = next(c["topic"] for c in self.channels.values() if c["id"] == subscription)
                self.got.append((topic, at_ns, data[13:]))
            return
        word = json.loads(data)
        self.words.append(word)
        for channel in word.get("channels", ()):
            self.channels[channel["topic"]] = channel

    def until(self, true, turn=lambda: None):
        while not true():
            turn()
            self.receive()

    def subscribe(self, *topics):
        """Each subscription has the id of its channel."""
        ids = [self.channels[topic]["id"] for topic in topics]
        rows = [{"id": one, "channelId": one} for one in ids]
        self.peer.send(json.dumps({"op": "subscribe", "subscriptions": rows}))

    def of(self, topic):
        return [(at_ns, payload) for name, at_ns, payload in self.got if name == topic]


@pytest.fixture
def world():
    with World(drive_s=2.0) as made:
        yield made


@pytest.fixture
def viewer(world):
    made = Viewer(world.server.port)
    made.until(lambda: len(made.channels) == len(CHANNELS) + 2)
    yield made
    made.peer.close()


def test_the_server_says_who_it_is_and_takes_nothing_from_a_client(viewer):
    (info,) = (word for word in viewer.words if word["op"] == "serverInfo")
    assert viewer.peer.subprotocol == SUBPROTOCOL and info["name"] == "El Dorado"
    assert not {"clientPublish", "parameters", "services"} & set(info["capabilities"])


def test_topics_and_schemas_are_those_of_an_exported_record(viewer):
    shared = set(VIEWS) & set(viewer.channels)
    assert {"/pose", "/tf", "/log", "/can/POWER_STATUS", "/can/WHEEL_1_FEEDBACK"} <= shared
    for topic in shared:
        channel, view = viewer.channels[topic], VIEWS[topic]
        assert (channel["schemaName"], channel["encoding"], channel["schemaEncoding"]) == (
            view.schema,
            "json",
            "jsonschema",
        )
        assert json.loads(channel["schema"])["properties"] == dict(view.fields)
    assert {viewer.channels[topic]["schemaName"] for topic in ("/map", "/points")} == {
        "foxglove.Grid",
        "foxglove.PointCloud",
    }


def test_poses_and_events_are_read_live(world, viewer):
    viewer.subscribe("/pose", "/tf", "/log", "/telemetry", "/link")
    viewer.until(lambda: len(viewer.of("/pose")) > 3 and viewer.of("/link"), world.turn)
    world.station.rover.event(world.now_ns, "ARRIVED", "there")
    viewer.until(lambda: viewer.of("/log"), world.turn)
    for (at_ns, pose), (_, transform) in zip(viewer.of("/pose"), viewer.of("/tf")):
        pose, transform = json.loads(pose), json.loads(transform)
        assert (transform["parent_frame_id"], transform["child_frame_id"]) == (pose["frame_id"], "base_link")
        assert transform["translation"] == pose["pose"]["position"]
        place, q = pose["pose"]["position"], pose["pose"]["orientation"]
        assert pose["timestamp"]["sec"] * S + pose["timestamp"]["nsec"] == at_ns
        assert (place["x"], place["y"]) == (pytest.approx(at_ns / S, abs=1e-3), 2.0)  # the toy drives at 1 m/s
        yaw_rad = math.atan2(2 * (q["w"] * q["z"] + q["x"] * q["y"]), 1 - 2 * (q["y"] ** 2 + q["z"] ** 2))
        assert yaw_rad == pytest.approx(ANGLES[2], abs=1e-5)
    (_, event), *_ = viewer.of("/log")
    assert json.loads(event).items() >= {"level": 2, "message": "there", "name": "ARRIVED"}.items()
    assert json.loads(viewer.of("/telemetry")[0][1])["mode"] == 1
    assert json.loads(viewer.of("/link")[0][1])["datagrams"] > 0


def test_a_client_that_comes_later_gets_the_newest_map_and_cloud_at_once(world, viewer):
    scan, ldem = encode_scan(room(40, 60)), world.station.rover.map
    products = Product(1, "ldem", "ldem-2", ldem), Product(2, "scan", "scan-1", scan)
    world.turn([ProductHeard(0, one) for one in products])
    viewer.subscribe("/map", "/points")
    viewer.until(lambda: viewer.of("/map") and viewer.of("/points"), world.turn)
    terrain = decode_ldem(ldem)
    cells = np.empty(terrain.heights_m.shape, shapes.CELL)
    cells["elevation"], cells["node_set"] = terrain.heights_m, terrain.node_sets
    assert cells.tobytes() in viewer.of("/map")[0][1]
    points = shapes.points(decode_scan(scan))
    assert len(points) > 10 and points.tobytes() in viewer.of("/points")[0][1]
    assert b"foxglove" in base64.b64decode(viewer.channels["/points"]["schema"])  # a FileDescriptorSet


def test_a_restarted_rover_begins_a_new_session_of_the_viewer(world, viewer):
    viewer.until(lambda: world.station.session.boot_id == 1, world.turn)
    first = [word["sessionId"] for word in viewer.words if word["op"] == "serverInfo"]
    world.station.rover = VirtualStation(boot_id=2).rover
    viewer.until(lambda: len([w for w in viewer.words if w["op"] == "serverInfo"]) > len(first), world.turn)
    assert [w["sessionId"] for w in viewer.words if w["op"] == "serverInfo"][-1] != first[-1]


def test_a_link_that_is_opened_again_keeps_the_map_and_the_session_of_the_viewer(world, viewer):
    viewer.until(lambda: world.station.session.boot_id == 1, world.turn)
    world.turn([ProductHeard(0, Product(1, "ldem", "ldem-2", world.station.rover.map))])
    world.station = VirtualStation()  # nothing was received in its session yet
    world.server.turn([], world.station.session, 0)
    assert "/map" in world.server._newest
    viewer.subscribe("/map")
    viewer.until(lambda: viewer.of("/map"), world.turn)
    assert len({word["sessionId"] for word in viewer.words if word["op"] == "serverInfo"}) == 1


def test_two_viewers_see_the_same_and_one_that_leaves_disturbs_nobody(world, viewer):
    second = Viewer(world.server.port)
    second.until(lambda: "/pose" in second.channels)
    for one in (viewer, second):
        one.subscribe("/pose")
    while not (viewer.of("/pose") and second.of("/pose")):
        world.turn()
        viewer.receive()
        second.receive()
    second.peer.close()
    count = len(viewer.of("/pose"))
    viewer.until(lambda: len(viewer.of("/pose")) > count + 3, world.turn)


def test_the_server_ends_with_the_operation():
    with World() as world:
        viewer = Viewer(world.server.port)
        viewer.until(lambda: viewer.channels)
    with pytest.raises(ConnectionClosed):
        while True:
            viewer.peer.recv(timeout=60)


def test_a_port_in_use_is_one_line_that_says_what_to_do():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        server = FoxgloveServer("127.0.0.1", taken.getsockname()[1])
        with pytest.raises(StationError, match=r"in use.*--foxglove-port"):
            server.__enter__()


def items(**values):
    return {name: Item(0, 5 * S, name, value) for name, value in values.items()}


def test_values_of_wheels_and_battery_come_under_the_names_of_their_frames():
    told = items(steer_2_rad=0.5, rate_2_radps=1.0, wheel_state_2=1.0, voltage_v=27.0, current_a=math.nan)
    made = {m.topic: m.value for m in messages(list(told.values()), told)}
    assert made["/can/WHEEL_2_FEEDBACK"] == {"steer_rad": 0.5, "rate_radps": 1.0, "state": 1.0}
    assert made["/can/POWER_STATUS"] == {"voltage_v": 27.0}  # what is not known is left out: JSON has no NaN
    assert "/can/WHEEL_1_FEEDBACK" not in made and "/pose" not in made and "/goal" not in made


def test_every_live_field_is_one_of_the_frame_and_of_the_telemetry():
    fields = {f"/can/{frame.name}": set(frame.fields) for frame in CAN.values()}
    for topic, names in FRAMES.items():
        assert set(names) <= fields[topic] and set(names.values()) <= {row.name for row in TABLE}


def test_a_pose_is_published_only_when_all_of_it_is_known():
    place = dict.fromkeys(("x_m", "y_m", "z_m", "roll_rad", "pitch_rad"), 1.0)
    assert all(m.topic != "/pose" for m in messages(list(items(**place).values()), items(**place)))
    whole = items(**place, yaw_rad=1.0)
    assert [m.topic for m in messages(list(whole.values()), whole)] == ["/telemetry", "/pose", "/tf"]


def test_an_answer_to_a_goto_is_a_path_and_a_damaged_one_is_left_out():
    way = {
        "station": 1,
        "request_id": 1,
        "kind": "drive",
        "rule": "R1",
        "reason": "",
        "length_m": 2.0,
        "time_s": 9.0,
        "looks": 1,
        "path": [[0, 0, 0], [1, 0, 0.5]],
        "beyond": [[2, 1]],
    }
    (path,) = messages([ProductHeard(0, Product(1, "way", "json", json.dumps(way).encode()))], {})
    assert [(p["position"]["x"], p["position"]["y"]) for p in path.value["poses"]] == [(0, 0), (1, 0), (2, 1)]
    assert not list(messages([ProductHeard(0, Product(1, "way", "json", b"{"))], {}))


def test_an_event_is_stamped_with_the_time_at_which_it_happened():
    (event,) = messages([EventHeard(9 * S, 4 * S, 1, "error", "FAULT", "no")], {})
    assert (event.topic, event.at_ns, event.value["level"]) == ("/log", 4 * S, 4)


class SteppedStation(VirtualStation):
    """A virtual station on the page's clock: its rover takes all of its ticks up to each turn."""

    ticks = 0

    def turn(self, turn):
        news = []
        while self.ticks * TICK_NS <= turn.now_ns:
            news += super().turn(ClockTurn(self.ticks * TICK_NS, None))
            self.ticks += 1
        return news


@contextmanager
def page_link(on_turn):
    """The page's link thread on a virtual station, until the end of the block."""
    live = Live(StationSettings(bench_seed=7), lambda *_: None, lambda *_: SteppedStation(), on_turn)
    live.start()
    try:
        yield live
    finally:
        live.stop()


def test_the_pages_own_link_feeds_the_viewer():
    with FoxgloveServer("127.0.0.1", 0) as server, page_link(server.turn):
        viewer = Viewer(server.port)
        viewer.until(lambda: "/telemetry" in viewer.channels)
        viewer.subscribe("/telemetry", "/link")
        viewer.until(lambda: viewer.of("/telemetry") and viewer.of("/link"))
        viewer.peer.close()


def test_a_view_that_fails_does_not_end_the_link_and_with_it_stop():
    calls, ended = [], Event()

    def fail(news, session, now_ns):
        calls.append(now_ns)
        ended.set()
        raise ValueError("no view")

    with page_link(fail) as live:
        assert ended.wait(300)
        assert live.ask("stop", {}, "test").result(timeout=300)
        assert len(calls) == 1 and any("no view" in text for text in live._says)


def serve(*words):
    return run(["serve", *words])


def test_serve_without_page_and_without_foxglove_is_a_usage_error(tmp_path, capsys):
    (tmp_path / "ground.toml").write_text('endpoint = "tcp/127.0.0.1:9"\nbench_seed = 1\n')
    assert serve("--no-page", "--station", str(tmp_path / "ground.toml")) == 64
    assert "--foxglove" in capsys.readouterr().err


def test_serve_names_the_extra_where_the_library_is_missing(tmp_path, capsys, monkeypatch):
    (tmp_path / "ground.toml").write_text('endpoint = "tcp/127.0.0.1:9"\nbench_seed = 1\n')
    monkeypatch.setitem(sys.modules, "foxglove", None)
    monkeypatch.delitem(sys.modules, "ground.foxglove.server")
    assert serve("--foxglove", "--station", str(tmp_path / "ground.toml")) == 64
    assert ".[foxglove]" in capsys.readouterr().err


def test_serve_on_a_port_in_use_ends_with_69_and_the_option_to_change(tmp_path, capsys):
    (tmp_path / "ground.toml").write_text('endpoint = "tcp/127.0.0.1:9"\nbench_seed = 1\n')
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert serve("--foxglove", "--foxglove-port", port, "--station", str(tmp_path / "ground.toml")) == 69
    said = capsys.readouterr().err
    assert "--foxglove-port" in said and said.count("\n") == 1
