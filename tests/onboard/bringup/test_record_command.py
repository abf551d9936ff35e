"""`onboard record info|cut|export`: the figures are those of the run, a slice says what it is, exports are readable."""

import csv
import hashlib
import json
import math
import re
from pathlib import Path

import pytest
from mcap.reader import make_reader

from onboard.__main__ import app
from onboard.bringup.records.foxglove import VIEWS
from onboard.record import made_by
from onboard.record.reader import open_record
from onboard.record.replay import replay
from onboard.record.schema import LAYOUTS
from protocol.generated.can_codec import TABLE
from tests.onboard.record_rig import fly, of_everything

ROOT = Path(__file__).parents[3]
LAYOUT = ROOT / "docs" / "foxglove.json"
TICKS = 200


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return fly(tmp_path_factory.mktemp("record") / "onboard.mcap", ticks=TICKS, say=of_everything)[0]


@pytest.fixture
def run(capsys):
    """Exit code, standard output, standard error of the command."""

    def runner(*words):
        with pytest.raises(SystemExit) as ended:
            app(["record", *map(str, words)], prog_name="onboard")
        return ended.value.code or 0, *capsys.readouterr()

    return runner


def test_info_counts_ticks_channels_and_attachments(run, record):
    code, out, err = run("info", record, "--json")
    told = json.loads(out)
    assert (code, err) == (0, "")
    assert (told["ticks"], told["first_tick"], told["last_tick"], told["missing"]) == (TICKS, 1, TICKS, 0)
    assert told["seconds"] == pytest.approx((TICKS - 1) * 0.01)
    assert told["closed"] and told["replayable"] and told["cut_off"] == ""
    messages = [messages for _, messages in open_record(record).ticks()]
    for topic, row in told["channels"].items():
        held = [m[topic] for m in messages if topic in m]
        assert (row["messages"], row["bytes"]) == (len(held), sum(map(len, held)))
    config = open_record(record).attachments["config.toml"]
    assert told["attachments"]["config.toml"] == {"bytes": len(config), "sha256": hashlib.sha256(config).hexdigest()}
    assert told["files"][0]["bytes"] == record.stat().st_size
    assert "numpy" in told["versions"]


def test_a_record_names_the_program_that_made_it_and_holds_the_tables_of_its_wires(run, record):
    held, root = open_record(record).attachments, Path(made_by.__file__).parents[2]
    for name in ("rover.dbc", "eldorado.xml"):
        assert held[name] == (root / "protocol" / name).read_bytes()
    versions = json.loads(run("info", record, "--json")[1])["versions"]
    assert versions["sources_sha256"] == made_by.sources_sha256(root) and versions["commit"]


def test_a_program_without_a_history_says_that_its_commit_is_unknown_and_a_changed_line_changes_its_digest(tmp_path):
    for package in ("onboard", "protocol"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "one.py").write_text("A = 1\n")
    before = made_by.sources_sha256(tmp_path)
    assert made_by.commit(tmp_path) == "unknown"
    (tmp_path / "protocol" / "one.py").write_text("A = 2\n")
    assert made_by.sources_sha256(tmp_path) != before
    (tmp_path / "onboard" / made_by.COMMIT).write_text("0123abcd, changed\n")
    assert made_by.commit(tmp_path) == "0123abcd, changed"


def test_two_runs_alike_have_the_same_sums_and_another_has_not(run, record, tmp_path):
    def sums(path):
        told = json.loads(run("info", path, "--json")[1])
        return told["inputs_sha256"], told["outputs_sha256"]

    again = fly(tmp_path / "again.mcap", ticks=TICKS, say=of_everything)[0]
    other = fly(tmp_path / "other.mcap", ticks=TICKS)[0]
    assert sums(again) == sums(record)
    assert sums(other)[0] != sums(record)[0]


def test_info_for_people_says_the_same(run, record):
    code, out, _ = run("info", record)
    assert code == 0
    assert f"ticks       {TICKS}, 1 to {TICKS}, 1.99 s" in out and "end         closed" in out
    assert re.search(r"^/in/can +\d+ +\d+ +1 +200$", out, re.MULTILINE)


def test_a_slice_from_the_start_replays_and_says_from_where_it_comes(run, record, tmp_path):
    out = tmp_path / "slice.mcap"
    assert run("cut", record, "--ticks", ":80", "--out", out)[0] == 0
    assert replay(out).ticks == 80 and replay(out).identical
    told = json.loads(run("info", out, "--json")[1])["files"][0]
    assert (told["cut_from"], told["cut_ticks"]) == ("onboard.mcap", "1 to 80")
    assert told["cut_from_sha256"] == hashlib.sha256(record.read_bytes()).hexdigest()


def test_a_slice_that_begins_later_has_all_of_its_ticks_and_says_that_it_cannot_be_replayed(run, record, tmp_path):
    out = tmp_path / "slice.mcap"
    code, said, _ = run("cut", record, "--seconds", "0.5:1.2", "--out", out)
    assert code == 0 and "cannot be replayed" in said
    expected = [(n, m) for n, m in open_record(record).ticks() if 50 <= n <= 120]
    assert list(open_record(out).ticks()) == expected
    assert not json.loads(run("info", out, "--json")[1])["replayable"]
    with pytest.raises(ValueError, match=r"begins at tick 50: a slice of onboard\.mcap"):
        replay(out)


def test_a_replayable_slice_keeps_the_inputs_before_it_and_compares_its_own_ticks_in_full(run, record, tmp_path):
    out = tmp_path / "slice.mcap"
    assert run("cut", record, "--ticks", "150:180", "--replayable", "--out", out)[0] == 0
    verdict = replay(out)
    assert verdict.identical and verdict.ticks == 180
    whole = dict(open_record(record).ticks())
    for number, messages in open_record(out).ticks():
        kept = {t: d for t, d in whole[number].items() if t[:4] == "/in/" or t in ("/out/tick", "/out/event")}
        assert messages == (whole[number] if number >= 150 else kept)
    assert verdict.bytes_compared["/out/pose"] == 31 * 48
    code, *_ = run("cut", out, "--out", tmp_path / "again.mcap")
    assert code == 0 and replay(tmp_path / "again.mcap").bytes_compared == verdict.bytes_compared


@pytest.mark.parametrize("words", [["--ticks", "5"], ["--ticks", "9:3"], ["--ticks", "a:b"], ["--seconds", "-1:2"],
                                   ["--ticks", "900:950"], ["--ticks", "900:950", "--replayable"],
                                   ["--seconds", "99999:", "--replayable"],
                                   ["--ticks", "1:2", "--seconds", "1:2"]])  # fmt: skip
def test_a_slice_that_is_none_ends_with_64_and_leaves_no_file(run, record, tmp_path, words):
    code, out, err = run("cut", record, *words, "--out", tmp_path / "slice.mcap")
    assert (code, out, err.count("\n")) == (64, "", 1)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("more", [[], ["--replayable"]])
def test_a_slice_that_ends_behind_the_record_ends_with_it(run, record, tmp_path, more):
    assert run("cut", record, "--ticks", "190:9000", *more, "--out", tmp_path / "slice.mcap")[0] == 0
    assert list(open_record(tmp_path / "slice.mcap").ticks())[-1][0] == TICKS


def test_a_file_that_is_there_is_written_over_only_by_force_and_the_record_itself_never(run, record, tmp_path):
    there = tmp_path / "there.mcap"
    there.write_bytes(b"mine")
    assert run("cut", record, "--out", there)[0] == 73
    assert there.read_bytes() == b"mine"
    assert run("cut", record, "--out", there, "--force")[0] == 0
    before = record.read_bytes()
    assert run("cut", record, "--out", record, "--force")[0] == 73
    assert record.read_bytes() == before


@pytest.mark.parametrize("words", [["info"], ["cut", "--out", "x.mcap"], ["export", "--out", "x.csv"]])
def test_what_is_no_record_ends_with_65_and_what_is_not_there_with_66(run, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "none.mcap").write_bytes(b"no record at all, and no MCAP")
    code, out, err = run(words[0], "none.mcap", *words[1:])
    assert (code, out, err.count("\n")) == (65, "", 1)
    assert run(words[0], "gone.mcap", *words[1:])[0] == 66


# -- export ------------------------------------------------------------------------------------------------------------


def test_csv_has_a_row_for_each_row_and_a_column_for_each_name(run, record, tmp_path):
    out = tmp_path / "run.csv"
    assert run("export", record, "--channels", "/out/pose,/in/can", "--out", out)[0] == 0
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    poses = [row for row in rows if row["channel"] == "/out/pose"]
    assert len(poses) == TICKS and {"x_m", "yaw_rad", "frame", "rate_radps"} <= set(rows[0])
    assert [float(row["t_s"]) for row in poses] == pytest.approx([0.01 * n for n in range(1, TICKS + 1)])
    frames = {row["frame"] for row in rows if row["channel"] == "/in/can"}
    assert frames <= {row.name for row in TABLE.values()} and "WHEEL_1_FEEDBACK" in frames


def test_json_lines_have_every_channel_in_words(run, record, tmp_path):
    out = tmp_path / "run.jsonl"
    assert run("export", record, "--out", out)[0] == 0
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    present = {topic for _, messages in open_record(record).ticks() for topic in messages}
    assert {row["channel"] for row in rows} == present
    assert {"tick", "t_s"} <= set(rows[0])


@pytest.mark.parametrize(("words", "hint"), [
    (["--out", "x.xls"], ".csv"), (["--out", "x.csv", "--channels", "/in/cam"], "/in/can")])  # fmt: skip
def test_a_format_or_channel_that_is_none_ends_with_64_and_names_those_there_are(run, record, words, hint):
    code, out, err = run("export", record, *words)
    assert (code, out) == (64, "") and hint in err and err.count("\n") == 1


@pytest.fixture(scope="module")
def view(record, tmp_path_factory):
    out = tmp_path_factory.mktemp("view") / "view.mcap"
    with pytest.raises(SystemExit):
        app(["record", "export", str(record), "--out", str(out)], prog_name="onboard")
    return out


def test_foxglove_gets_json_that_fits_the_schema_of_its_channel(view):
    met = set()
    with view.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            shape, value = json.loads(schema.data), json.loads(message.data)
            assert schema.encoding == "jsonschema" and channel.message_encoding == "json"
            assert schema.name == shape["title"] == VIEWS[channel.topic].schema
            assert fits(value, shape), channel.topic
            met.add(channel.topic)
    assert {"/pose", "/tf", "/log", "/health", "/machine"} <= met


def fits(value, shape):
    """As far as the schemas here go: types, and no name that is not in them."""
    if shape["type"] == "object":
        known = shape["properties"]
        return isinstance(value, dict) and all(name in known and fits(v, known[name]) for name, v in value.items())
    return isinstance(value, {"number": (int, float), "string": str}[shape["type"]])


def test_the_pose_is_turned_as_the_rover_is():
    from onboard.bringup.records.foxglove import _quaternion
    from onboard.records import Pose

    angles = (0.1, -0.2, 2.5)
    turn = _quaternion(*angles)
    x, y, z, w = (turn[axis] for axis in "xyzw")
    ahead = [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)]
    assert ahead == pytest.approx(Pose(0.0, 0.0, 0.0, *angles).matrix()[:3, 0].tolist())
    assert math.hypot(x, y, z, w) == pytest.approx(1.0)


def paths(node):
    """Every message path of a layout: strings that begin with a topic."""
    if isinstance(node, dict):
        return [p for key, item in node.items() for p in [*paths(item), *([key] if key.startswith("/") else [])]]
    if isinstance(node, list):
        return [p for item in node for p in paths(item)]
    return [node] if isinstance(node, str) and node.startswith("/") else []


def test_the_layout_for_foxglove_asks_only_for_channels_and_fields_that_are_written():
    asked = paths(json.loads(LAYOUT.read_text()))
    assert len(asked) > 10
    for path in asked:
        topic = next((t for t in sorted(VIEWS, key=len, reverse=True) if path == t or path.startswith(f"{t}.")), None)
        assert topic is not None, path
        shape = {"type": "object", "properties": VIEWS[topic].fields}
        for name in path.removeprefix(topic).split(".")[1:]:
            assert name in shape["properties"], path
            shape = shape["properties"][name]
        if path != topic:
            assert shape["type"] == "number", path


def test_every_panel_of_the_layout_is_shown_once():
    layout = json.loads(LAYOUT.read_text())

    def shown(node):
        return [node] if isinstance(node, str) else [*shown(node["first"]), *shown(node["second"])]

    assert sorted(shown(layout["layout"])) == sorted(layout["configById"])


def test_every_view_is_made_from_a_channel_of_the_record():
    assert {view.source for view in VIEWS.values()} <= set(LAYOUTS)
