"""`onboard record export --ros2`: rosbags reads the bag, and each field is that of the record."""

import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from hil.devices.can.nodes import build_nodes
from hil.records import PlantState, WheelTruth
from onboard import config
from onboard.__main__ import app
from onboard.bringup.lidar.sweeps import sweeps_of
from onboard.bringup.ros2.follow import TOPICS
from onboard.record.reader import open_record
from onboard.record.replay import config_of
from onboard.record.rows import ROWS
from onboard.record.writer import Recorder
from onboard.records import Inputs, JobDone, NodeSet, Outputs
from protocol.conventions import TICK_NS
from protocol.generated import eldorado_dialect as dialect
from protocol.generated.can_codec import TABLE
from protocol.tables import telemetry
from protocol.tables.faults import FAULTS
from tests.onboard.nodding import EXACT, Nodding, latency_ns
from tests.onboard.planning.test_plan_archive import GRID, made
from tests.onboard.record_rig import fly

URDF = Path(__file__).parents[3] / "docs" / "rover.urdf"
TICKS, RATE_RADPS, STEER_RAD = 150, 1.0, 0.0
ANGLES = (0.05, -0.1, 2.5)


def export(*words):
    with pytest.raises(SystemExit) as ended:
        app(["record", "export", *map(str, words)], prog_name="onboard")
    return ended.value.code or 0


def read(bag):
    """Topic -> [(time ns, message)], by rosbags, with the types that are in the bag."""
    found = {}
    with AnyReader([bag]) as reader:
        for connection, at_ns, raw in reader.messages():
            found.setdefault(connection.topic, []).append((at_ns, reader.deserialize(raw, connection.msgtype)))
    return found


def ns(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def driving(now_ns):
    """A rover that rolls ahead: all wheels at one rate."""
    zero, rolled = np.zeros(3), RATE_RADPS * now_ns / 1e9
    wheel = WheelTruth(STEER_RAD, rolled, RATE_RADPS, 0.5)
    return PlantState(now_ns, zero, np.array([0, 0, 0, 1.0]), zero, zero, np.array([0.0, 0.0, 1.62]), (wheel,) * 4)


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """(record, bag) of a rolling rover whose pose moves, with one plan."""
    folder = tmp_path_factory.mktemp("driven")
    path, nodes = folder / "onboard.mcap", build_nodes(3)
    flown = config.load(None, {"record.path": str(path), "clock.mode": "lockstep"})
    with Recorder(flown, None) as recorder:
        for number in range(1, TICKS + 1):
            now_ns = number * TICK_NS
            nodes.step(now_ns, driving(now_ns))
            jobs = (JobDone(7, made()),) if number == 60 else ()
            pose = (0.01 * number, -0.02 * number, 0.1, *ANGLES)
            recorder.write(Inputs(number, now_ns, can_frames=tuple(nodes.send()), jobs=jobs),
                           Outputs(state_digest=bytes(8), pose=pose))  # fmt: skip
    assert export(path, "--ros2", "--out", folder / "bag") == 0
    return path, read(folder / "bag")


def without_wheel_1(inputs):
    """The node of wheel 1 falls silent after a second."""
    heard = (frame for frame in inputs.can_frames if TABLE[frame.can_id].sender != "WHEEL_1")
    return inputs if inputs.tick <= 100 else replace(inputs, can_frames=tuple(heard))


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """(record, bag) of the core on a standing rover that loses a wheel: telemetry, events and faults are its own."""
    folder = tmp_path_factory.mktemp("flown")
    path = fly(folder / "onboard.mcap", ticks=250, say=without_wheel_1)[0]
    assert export(path, "--ros2", "--out", folder / "bag") == 0
    return path, read(folder / "bag")


def test_odometry_and_transform_are_the_recorded_pose_in_the_frames_of_rep_105(driven):
    path, bag = driven
    poses = {number: row for number, m in open_record(path).ticks() for row in ROWS["/out/pose"](m["/out/pose"])}
    assert len(bag["/odom"]) == len(bag["/tf"]) == TICKS // 5
    for (at_ns, odom), (_, tf), number in zip(bag["/odom"], bag["/tf"], range(5, TICKS + 1, 5)):
        (moved,), row = tf.transforms, poses[number]
        assert at_ns == ns(odom.header.stamp) == ns(moved.header.stamp) == number * TICK_NS
        assert odom.header.frame_id == moved.header.frame_id == "map"
        assert odom.child_frame_id == moved.child_frame_id == "base_link"
        place, turn = odom.pose.pose.position, odom.pose.pose.orientation
        assert (place.x, place.y, place.z) == (row["x_m"], row["y_m"], row["z_m"])
        shift, q = moved.transform.translation, moved.transform.rotation
        assert (shift.x, shift.y, shift.z) == (place.x, place.y, place.z)
        assert (q.x, q.y, q.z, q.w) == (turn.x, turn.y, turn.z, turn.w)
        expected = Rotation.from_euler("ZYX", (row["yaw_rad"], row["pitch_rad"], row["roll_rad"]))
        assert (Rotation.from_quat((q.x, q.y, q.z, q.w)) * expected.inv()).magnitude() < 1e-12


def test_the_twist_is_the_wheels_own_in_base_link(driven):
    path, bag = driven
    speed_mps = RATE_RADPS * config_of(open_record(path)).rover.wheel_radius_m
    last = bag["/odom"][-1][1].twist
    assert last.twist.linear.x == pytest.approx(speed_mps, rel=0.01)
    assert (last.twist.linear.y, last.twist.angular.z) == (pytest.approx(0, abs=1e-3),) * 2
    assert not last.covariance.any()  # not recorded


def test_joints_are_the_wheels_newest_reports_by_the_names_of_the_urdf(driven):
    path, bag = driven
    revolving = set(re.findall(r'joint name="(\w+)" type="(?:revolute|continuous)"', URDF.read_text()))
    newest = {}
    reports = {}
    for number, messages in open_record(path).ticks():
        newest |= {row["frame"]: row for row in ROWS["/in/can"](messages["/in/can"])}
        reports[number * TICK_NS] = dict(newest)
    assert len(bag["/joint_states"]) == TICKS // 5
    for at_ns, joints in bag["/joint_states"]:
        assert ns(joints.header.stamp) == at_ns
        assert set(joints.name) <= revolving and len(joints.effort) == 0
        at = {name: (p, v) for name, p, v in zip(joints.name, joints.position, joints.velocity, strict=True)}
        for n, corner in enumerate(("front_left", "rear_left", "rear_right", "front_right"), 1):
            row = reports[at_ns][f"WHEEL_{n}_FEEDBACK"]
            assert at[f"{corner}_steer_joint"][0] == pytest.approx(row["steer_rad"], abs=1e-12)
            assert math.isnan(at[f"{corner}_steer_joint"][1])
            assert at[f"{corner}_wheel_joint"][1] == row["rate_radps"]
    first, last = bag["/joint_states"][0], bag["/joint_states"][-1]
    rolled = last[1].position[1] - first[1].position[1]
    assert rolled == pytest.approx(RATE_RADPS * (last[0] - first[0]) / 1e9, abs=0.01)
    assert "scanner_tilt_joint" in last[1].name


def test_maps_and_paths_are_those_of_the_plan(driven):
    bag, plan = driven[1], made()
    ((at_ns, grid),) = bag["/map"]
    assert at_ns == ns(grid.header.stamp) == 60 * TICK_NS and grid.header.frame_id == "map"
    assert (grid.info.width, grid.info.height) == (GRID.columns, GRID.rows)
    assert grid.info.resolution == np.float32(GRID.cell_m)
    corner = grid.info.origin.position
    assert (corner.x, corner.y) == (GRID.x0_m - GRID.cell_m / 2, GRID.y0_m - GRID.cell_m / 2)
    assert grid.info.origin.orientation.w == 1.0
    cells = grid.data.reshape(GRID.rows, GRID.columns)
    means = {NodeSet.FREE: 0, NodeSet.OBSTACLE: 100}
    assert (cells == np.vectorize(means.get)(plan.report.node_sets)).all()
    for topic, points in (("/path/global", plan.report.global_path), ("/path/local", plan.decision.path.stations)):
        ((_, path),) = bag[topic]
        assert path.header.frame_id == "map" and len(path.poses) == len(points)
        for stamped, (x, y, *rest) in zip(path.poses, points):
            at, q = stamped.pose.position, stamped.pose.orientation
            assert (at.x, at.y, at.z) == (x, y, 0.0)
            assert 2 * math.atan2(q.z, q.w) == pytest.approx(rest[0] if rest else 0.0)


def test_a_grid_map_has_each_height_where_its_convention_looks_for_it(driven):
    """Position of cell (row, column) in grid_map: the map's greatest x and y less half a cell, less the index."""
    ((_, message),), plan = driven[1]["/grid_map"], made()
    assert message.layers == ["elevation", "node_set"] and message.basic_layers == ["elevation"]
    info, middle = message.info, message.info.pose.position
    for layer, truth in zip(message.data, (plan.report.z_mean, plan.report.node_sets)):
        outer, inner = layer.layout.dim
        assert (outer.label, inner.label) == ("column_index", "row_index")
        assert outer.stride == outer.size * inner.size == layer.data.size and inner.stride == inner.size
        for row, column in ((0, 0), (3, 5), (inner.size - 1, 2), (7, outer.size - 1)):
            x_m = middle.x + info.length_x / 2 - (row + 0.5) * info.resolution
            y_m = middle.y + info.length_y / 2 - (column + 0.5) * info.resolution
            i, j = round((y_m - GRID.y0_m) / GRID.cell_m), round((x_m - GRID.x0_m) / GRID.cell_m)
            np.testing.assert_equal(layer.data[column * inner.size + row], np.float32(truth[i, j]))


def test_covariances_and_diagnostics_are_the_telemetry_that_the_rover_sent(flown):
    path, bag = flown
    parser, sent, values = dialect.MAVLink(None), {}, {}
    for number, messages in open_record(path).ticks():
        for row in ROWS["/out/link"](messages.get("/out/link", b"")):
            if row["kind"] == "MAVLINK":
                told = [telemetry.values(m) for m in parser.parse_buffer(bytearray.fromhex(row["payload"]))]
                values = {**values, **{name: value for one in told for name, value in one.items()}}
                if any("faults" in one for one in told):
                    sent[number * TICK_NS] = values
    assert len(sent) >= 4 and [at_ns for at_ns, _ in bag["/diagnostics"]] == list(sent)
    for at_ns, array in bag["/diagnostics"]:
        rover, *faults = array.status
        active = {f.name for f in FAULTS if int(sent[at_ns]["faults"]) >> f.number & 1}
        assert {one.name.removeprefix("fault: ") for one in faults if one.level} == active
        assert [one.name for one in faults] == [f"fault: {f.name}" for f in FAULTS]
        told = {pair.key: pair.value for pair in rover.values}
        assert set(told) == set(sent[at_ns]) and told["mode"] in ("BOOT", "STANDBY", "SAFE")
        if math.isfinite(sent[at_ns].get("voltage_v", math.nan)):
            number, unit = told["voltage_v"].split()
            assert unit == "V" and float(number) == pytest.approx(sent[at_ns]["voltage_v"])
    silent = [one for _, array in bag["/diagnostics"] for one in array.status if one.name == "fault: WHEEL_SILENT"]
    assert [one.level for one in silent[:1] + silent[-1:]] == [0, 2] and "200 ms" in silent[-1].message
    last = bag["/odom"][-1][1].pose.covariance.reshape(6, 6)
    assert last[0, 0] + last[1, 1] == pytest.approx(values["sigma_position_m"] ** 2) and last[0, 0] > 0
    assert last[5, 5] == pytest.approx(values["sigma_yaw_rad"] ** 2)


def test_the_log_has_every_event_with_its_time_level_and_text(flown):
    path, bag = flown
    events = [row for _, m in open_record(path).ticks() for row in ROWS["/out/event"](m.get("/out/event", b"[]"))]
    levels = {"debug": 10, "info": 20, "warning": 30, "error": 40, "critical": 50}
    assert any("WHEEL_SILENT" in e["text"] for e in events)
    assert [(ns(m.stamp), m.level, m.name, m.msg) for _, m in bag["/rosout"]] == [
        (e["now_ns"], levels[e["severity"]], e["name"], e["text"]) for e in events
    ]


def test_a_sweep_becomes_a_cloud_on_the_room_that_was_scanned(tmp_path):
    path, bench = tmp_path / "onboard.mcap", Nodding(EXACT)
    flown = config.Config(record=config.Record(path=str(path)), lidar=config.Lidar(latency_ns=latency_ns(EXACT)))
    with Recorder(flown, None) as bench.recorder:
        bench.settle(3)
        bench.sweep(0, 20, 30)
    assert export(path, "--ros2", "--out", tmp_path / "bag", "--channels", "/in/lidar") == 0
    bag = read(tmp_path / "bag")
    (scan,) = sweeps_of(path, config_of(open_record(path)))
    ((at_ns, cloud),) = bag["/points"]
    assert set(bag) == {"/points"} and cloud.header.frame_id == "base_link"
    assert (ns(cloud.header.stamp), at_ns) == (scan.pixels["time_ns"].min(), scan.pixels["time_ns"].max())
    assert [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields] == [
        (name, 4 * k, 7, 1) for k, name in enumerate(("x", "y", "z", "intensity", "time"))
    ]
    assert (cloud.height, cloud.point_step, cloud.row_step) == (1, 20, 20 * cloud.width)
    rows = cloud.data.view("<f4").reshape(cloud.width, 5).astype(np.float64)
    good = scan.pixels["mask"] == 0
    assert cloud.width == good.sum() > 20_000
    np.testing.assert_allclose(np.linalg.norm(rows[:, :3] - [0.30, 0, 0.70], axis=1), scan.pixels["range_m"][good],
                               atol=1e-5)  # fmt: skip
    assert np.abs(rows[:, 2]).min() < 1e-3 and rows[:, 0].max() == pytest.approx(6.5, abs=0.01)  # floor, wall ahead
    since_s = (scan.pixels["time_ns"][good] - scan.pixels["time_ns"].min()) / 1e9
    np.testing.assert_allclose(rows[:, 4], since_s, atol=1e-6)


def test_a_reader_without_rosbags_finds_cdr_and_definitions_of_every_topic(driven, tmp_path):
    assert export(driven[0], "--ros2", "--out", tmp_path / "bag") == 0
    with (tmp_path / "bag" / "bag.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()} == {
        topic: row.kind for topic, row in TOPICS.items()
    }
    assert {c.message_encoding for c in summary.channels.values()} == {"cdr"}
    assert {s.encoding for s in summary.schemas.values()} == {"ros2msg"}


def test_a_damaged_record_leaves_the_bag_that_was_there(driven, tmp_path):
    path, bag = driven[0], tmp_path / "bag"
    assert export(path, "--ros2", "--out", bag, "--channels", "/out/event") == 0
    before = {file.name: file.read_bytes() for file in bag.iterdir()}
    damaged = tmp_path / "damaged.mcap"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    damaged.write_bytes(data)
    assert export(damaged, "--ros2", "--out", bag, "--force") == 65
    assert {file.name: file.read_bytes() for file in bag.iterdir()} == before


def test_a_bag_is_not_written_over_unless_told_and_never_anything_else(driven, tmp_path, capsys):
    path, bag = driven[0], tmp_path / "bag"
    assert export(path, "--ros2", "--out", bag, "--channels", "/out/event") == 0
    assert export(path, "--ros2", "--out", bag) == 73 and "--force" in capsys.readouterr().err
    assert export(path, "--ros2", "--out", bag, "--force") == 0 and "/odom" in read(bag)
    (bag / "notes.txt").write_text("mine")
    assert export(path, "--ros2", "--out", bag, "--force") == 73 and (bag / "notes.txt").read_text() == "mine"
    assert export(path, "--ros2", "--out", tmp_path / "run.mcap") == 64 and "folder" in capsys.readouterr().err
    assert export(tmp_path / "none.mcap", "--ros2", "--out", tmp_path / "b") == 66


def test_a_damaged_record_is_reported_and_leaves_no_bag(driven, tmp_path, capsys):
    raw = bytearray(driven[0].read_bytes())
    raw[len(raw) // 3] ^= 0xFF
    (tmp_path / "bad.mcap").write_bytes(raw)
    assert export(tmp_path / "bad.mcap", "--ros2", "--out", tmp_path / "bag") == 65
    assert "damaged" in capsys.readouterr().err and sorted(p.name for p in tmp_path.iterdir()) == ["bad.mcap"]


def test_without_rosbags_the_line_names_the_extra_to_install(driven, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags", None)
    for name in [name for name in sys.modules if name.startswith(("rosbags.", "onboard.bringup.ros2"))]:
        monkeypatch.delitem(sys.modules, name)
    assert export(driven[0], "--ros2", "--out", tmp_path / "bag") == 64
    assert ".[ros2]" in capsys.readouterr().err and not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", [b"", b"no record at all", b"\x89MCAP0\r\n"])
def test_a_file_that_is_no_record_is_one_line_and_leaves_no_bag(content, tmp_path, capsys):
    (tmp_path / "strange.mcap").write_bytes(content)
    assert export(tmp_path / "strange.mcap", "--ros2", "--out", tmp_path / "bag") == 65
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "Traceback" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["strange.mcap"]
