"""The mission report is one file that needs nothing else; a folder without a run is a one-line error."""

import math
import re
import shutil
import struct
import zipfile
from dataclasses import replace
from html import escape
from importlib.metadata import version

import numpy as np
import pytest
import typer
from mcap.writer import Writer
from typer.testing import CliRunner

from ground.cli.verbs.report import report_command
from ground.report import pictures, run_files
from ground.report.report import html, report
from ground.report.run_files import NoRunError, RoverEvent, angles_rad, read_run, spans_of
from ground.report.telemetry import Collector
from ground.report.words import EXPECTED_REFUSAL, RULES
from hil.records import Touch
from onboard.planning import mission_rule
from onboard.records import Pose
from protocol.generated import eldorado_dialect as dialect
from protocol.generated.can_codec import TABLE
from protocol.link.datagrams import DatagramKind
from tests.ground.synthetic_run import GOAL, write_run, write_truth


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("run")
    write_run(made)
    return made


def written(folder):
    write_run(folder, ground=False, bench=False, step=50)
    return folder


@pytest.fixture(scope="module")
def page(folder):
    return report(folder).read_text()


@pytest.fixture
def undrawn(monkeypatch):
    """Some bytes in place of each picture, for tests of the words: drawing is most of a page's time."""
    for name in vars(pictures).copy():
        if name.endswith("_picture"):
            monkeypatch.setattr(pictures, name, lambda *_: b"a picture")


def command(*words):
    app = typer.Typer()
    app.command()(report_command)
    return CliRunner().invoke(app, [str(word) for word in words])


def test_the_page_fetches_nothing_from_outside(page):
    assert not re.search(r"""src\s*=\s*["'](?!data:)|href\s*=\s*["'](?!#)""", page)
    assert "url(" not in page
    assert "@import" not in page
    assert "<script" not in page


def test_every_picture_is_inside_the_page_and_has_words(page):
    pictures = re.findall(r'<img alt="([^"]*)" src="data:image/png;base64,([^"]*)">', page)
    assert page.count("<img") == len(pictures) == 11
    scored = [words for words, _ in pictures if "where the strategy would scan next" in words]
    assert [words.split(":")[0] for words in scored] == ["Stop 1", "Stop 2"]  # the last decides by R4 alone
    assert all(len(words) > 20 and data.startswith("iVBORw0KGgo") for words, data in pictures)


@pytest.mark.parametrize(
    "fact",
    [
        "fractal ground, seed 3",
        "goal reached",
        "no contacts",
        "<p>None. Counted is each contact",
        "replay identical",
        "median slope 5.0°",
        "3000: the straight line is free",
        "6.0 times real time",
        "900 sent, 45 lost",
        "x 15.00 m, y 2.00 m",
        "ab" * 32,
        "cd" * 32,
        "ef" * 32,
        "Nothing here has met real hardware",
        "arrived: 0.12 m from the goal",
        "ets8-b: 256 kbit/s both ways",
        "p99.9 9.00 ms",
        "wall time of a tick",
        "2345 µs",
        "3.21 ms at worst",
        "23.4 ms",
        ">29<",
        "utm-30lx, 3.12 % of the beams lost (2.10 % grazing, 1.02 % random); 0.020 % outliers, 0.10 % mixed; "
        "clock off by 80 ppm, motor jitter 30 µs",
        "true distance to the goal, from the bench",
        "what the rover reported, by its own estimate",
    ],
)
def test_the_facts_are_on_the_page(page, fact):
    assert fact in page


def test_every_section_is_in_the_contents_and_each_entry_leads_to_one(page):
    contents = re.findall(r'<li><a href="#([^"]+)">', page)
    assert contents == re.findall(r'<section id="([^"]+)">', page) and len(contents) > 8


def test_version_commit_and_date_of_the_record_are_named(folder, undrawn):
    run = replace(read_run(folder), versions={"commit": "0123456789abcdef"}, written_utc_s=0.0)
    assert f"El Dorado {version('el-dorado')}, flight program of commit 0123456789ab" in html(run)
    assert "written on 1970-01-01 at 00:00 UTC" in html(run)


def test_records_of_earlier_boots_lie_before_the_last_one_on_one_axis(tmp_path, undrawn):
    write_run(tmp_path, ground=False, bench=False, step=50)
    alone = read_run(tmp_path)
    (tmp_path / "onboard.mcap").rename(tmp_path / "onboard-boot1.mcap")
    write_run(tmp_path, ground=False, bench=False, step=50)
    both = read_run(tmp_path)
    assert both.boots_s == (0.0, pytest.approx(89.5)) and len(both.plans) == 2 * len(alone.plans)
    assert np.all(np.diff(both.estimated.times_s) >= 0)
    assert [e.time_s for e in both.events][len(alone.events)] == pytest.approx(alone.events[0].time_s + 89.5)
    assert "started 2 times, again at 89.5 s" in report(tmp_path).read_text()


def test_a_damaged_record_of_an_earlier_boot_is_one_line(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "run")
    (tmp_path / "run" / "onboard-boot1.mcap").write_bytes(b"noise")
    with pytest.raises(NoRunError, match="damaged"):
        read_run(tmp_path / "run")


def bundle(*messages):
    return b"".join(struct.pack("<BH", DatagramKind.MAVLINK, len(m)) + m for m in messages)


def test_telemetry_currents_and_bytes_of_a_record_become_lines():
    heard, mavlink = Collector(), dialect.MAVLink(None)
    sent = [mavlink.sys_status_encode(0, 0, 0, 100, 25_500, 210, 80, 0, 0, 0, 0, 0, 0).pack(mavlink)]
    heard.out_link(3.0, bundle(*sent, b"noise"))
    status = TABLE[0x1A2].encode(1.25, 0.0, 20, 0, 0)
    heard.in_can(4.0, struct.pack("<qHB", 0, 0x1A2, 8) + status)
    lines = heard.lines()
    assert lines.voltage_v.tolist() == [[3.0, 25.5]]
    assert [rows.tolist() for rows in lines.wheel_currents_a] == [[], [[4.0, 1.25]], [], []]
    assert lines.sent_bits[:, 1].sum() == 8 * (sum(map(len, sent)) + len(b"noise"))


def test_decisions_stand_in_the_order_of_the_stops_with_their_reasons(page):
    cell = r"<td[^>]*>"
    rows = re.findall(rf"{cell}(\d)</td>{cell}([\d.]+) s</td>{cell}[^<]*</td>{cell}(\w+)</td>{cell}(R\d+)</td>", page)
    assert rows == [("1", "12.0", "drive", "R5"), ("2", "42.0", "drive", "R5"), ("3", "68.0", "goal", "R4")]


def test_only_the_rules_that_occur_are_explained_under_the_decisions(page):
    assert re.findall(r"<tr><th>(R\d+ \w+)</th>", page) == ["R1 start", "R2 trail", "R4 terminal", "R5 commit"]


def test_every_rule_of_the_mission_has_its_sentence():
    told = re.findall(r"^    (R\d+) ", mission_rule.__doc__, re.MULTILINE)
    assert set(RULES) == set(told)


@pytest.mark.parametrize(("name", "told"), [("REGISTERED", False), ("REGISTRATION_REFUSED", True)])
def test_a_refused_registration_is_explained_where_there_is_one(folder, name, told, undrawn):
    run = replace(read_run(folder), events=(RoverEvent(3.0, "info", name, ""),))
    assert (escape(EXPECTED_REFUSAL) in html(run)) == told


def test_words_of_the_record_cannot_become_markup(page):
    assert "look at &lt;the rest&gt;" in page
    assert "<the rest>" not in page


@pytest.mark.parametrize(("name", "data"), [
    ("summary.json", b"[" * 100_000), ("summary.json", b"[1]"), ("certificate.json", b"5"), ("link.json", b"\xff"),
    ("field.npz", b""), ("field.npz", b"PK"), ("truth.mcap", b"noise"), ("onboard.mcap", b""),
])  # fmt: skip
def test_a_damaged_file_of_a_run_is_one_line(folder, tmp_path, name, data):
    shutil.copytree(folder, tmp_path / "run")
    (tmp_path / "run" / name).write_bytes(data)
    with pytest.raises(NoRunError, match=name) as raised:
        read_run(tmp_path / "run")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("events", [b"[" * 100_000, b"[1]", b"5", b"{}x", b'[{"now_ns": "x"}]', b'[{"now_ns": 1e400}]'])
def test_events_that_no_flight_program_wrote_are_one_line(tmp_path, events):
    with (tmp_path / "onboard.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/out/event", "json", writer.register_schema("e", "jsonschema", b"{}"))
        writer.add_message(channel, 5, events, 5)
        writer.finish()
    with pytest.raises(NoRunError, match=r"onboard\.mcap is damaged"):
        read_run(tmp_path)


def test_a_ground_that_would_fill_the_memory_is_refused_before_it_is_unpacked(folder, tmp_path, monkeypatch):
    shutil.copytree(folder, tmp_path / "run")
    with zipfile.ZipFile(tmp_path / "run" / "field.npz", "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("truth_heights_m.npy", bytes(2 << 20))
    monkeypatch.setattr(run_files, "MOST_BYTES", 1 << 20)
    monkeypatch.setattr(np, "load", None)
    with pytest.raises(NoRunError, match=r"field.npz .*unpacks to 2097152 bytes"):
        run_files._ground(tmp_path / "run" / "field.npz")


def test_a_report_is_written_into_the_folder_of_the_run_and_through_no_link(tmp_path, undrawn):
    write_run(tmp_path, ground=False, bench=False, step=50)
    (tmp_path / "other").write_text("mine")
    (tmp_path / "report.html").symlink_to(tmp_path / "other")
    assert report(tmp_path) == tmp_path / "report.html"
    assert (tmp_path / "other").read_text() == "mine" and not (tmp_path / "report.html").is_symlink()


WHEEL = Touch(2, 0.09, (7.0, 3.0), (7.05, 3.1))


def test_contacts_stand_on_the_page_with_time_what_and_place(tmp_path, undrawn):
    """By the file of the truth alone: a simulation that was ended has no summary."""
    write_run(tmp_path, ground=False, bench=False, step=50)
    write_truth(tmp_path / "truth.mcap", touches=[(20.0, 22.0, WHEEL), (21.0, 21.5, Touch(0, 0.0, None, (7.3, 3.0)))])
    page = report(tmp_path).read_text()
    rows = re.findall(r"<tr>" + r"<td[^>]*>([^<]*)</td>" * 4 + "</tr>", page)
    assert ("20.0 s", "21.9 s", "wheel 2 on a rock of 0.09 m", "(7.05, 3.10)") in rows
    assert ("21.0 s", "21.4 s", "body on the ground", "(7.30, 3.00)") in rows
    assert '<span class="verdict bad">2 contacts</span>' in page


def test_a_summary_tells_contacts_where_the_truth_is_left_out(folder, undrawn):
    row = {"begin_s": 3.0, "end_s": 4.0, "what": "wheel 1 on a rock of 0.10 m", "x_m": 1.0, "y_m": 2.0}
    run = read_run(folder, with_truth=False)
    assert "wheel 1 on a rock of 0.10 m" in html(replace(run, facts={**run.facts, "contacts": [row]}))


def test_a_record_without_the_bench_claims_nothing_of_contacts(tmp_path, undrawn):
    write_run(tmp_path, ground=False, bench=False, step=50)
    assert read_run(tmp_path).contacts is None
    assert "contact" not in report(tmp_path).read_text()


def test_without_truth_the_page_shows_only_what_the_rover_knew(tmp_path):
    write_run(tmp_path, ground=True, bench=False, step=50)
    page = report(tmp_path, with_truth=False).read_text()
    assert "estimated speed" in page
    assert "against where it was" not in page
    assert page.count("<img") == 8


def test_without_a_goal_none_is_drawn(tmp_path):
    run = replace(read_run(written(tmp_path)), plans=(), facts={})
    assert pictures._goal(run) is None
    run.heard._items.update(goal_x_m=[(1.0, 8.0)], goal_y_m=[(1.0, 3.0)])
    assert pictures._goal(run) == (8.0, 3.0)
    assert html(replace(run, heard=Collector())).count("<img") > 3


def test_a_record_alone_is_enough(tmp_path):
    write_run(tmp_path, ground=False, bench=False, step=50)
    assert "arrived: 0.12 m from the goal" in report(tmp_path).read_text()


def test_a_run_is_read_as_it_was_written(folder):
    run = read_run(folder)
    assert [time_s for time_s, _ in run.plans] == [12.0, 42.0, 68.0]
    assert run.plans[0][1].goal_m.tolist() == list(GOAL)
    assert run.truth.track.position_m.shape == (900, 3)
    assert run.gdem.note == "made up"
    assert len(run.ground.rocks) > 50


def test_a_phase_ends_where_the_next_begins_and_the_last_with_the_mode():
    told = [
        ("PHASE", "SCANNING at stop 0", 1),
        ("DECISION", "R5", 2),
        ("PHASE", "DRIVING at stop 1", 3),
        ("MODE", "AUTONOMOUS -> STANDBY: arrived", 5),
        ("PHASE", "SCANNING at stop 0", 8),
    ]
    events = [RoverEvent(time_s, "info", name, text) for name, text, time_s in told]
    assert spans_of(events, 9.0) == ((1, 3, "SCANNING"), (3, 5, "DRIVING"), (8, 9.0, "SCANNING"))


def test_angles_of_a_quaternion_are_those_of_the_matrix():
    w, x, y, z = 0.8, 0.1, -0.3, 0.5
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / norm, x / norm, y / norm, z / norm
    roll, pitch, yaw = angles_rad(np.array([[x, y, z, w]]))[0]
    rotation = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    np.testing.assert_allclose(Pose(0, 0, 0, roll, pitch, yaw).matrix()[:3, :3], rotation, atol=1e-12)


def test_the_command_says_where_the_report_is(folder, undrawn):
    result = command(folder)
    assert (result.exit_code, result.stdout.strip()) == (0, str(folder / "report.html"))


def test_the_command_writes_the_picture_of_the_paths_alone(folder, tmp_path):
    file = tmp_path / "pictures" / "demo.png"
    assert command(folder, "--picture", file).exit_code == 0
    assert file.read_bytes().startswith(b"\x89PNG")


def test_a_folder_without_a_record_is_one_line_and_66(tmp_path):
    result = command(tmp_path / "nothing")
    assert result.exit_code == 66
    assert result.stderr.count("\n") == 1
    assert "onboard.mcap" in result.stderr


@pytest.mark.parametrize("name", ["onboard.mcap", "truth.mcap", "field.npz", "summary.json"])
def test_a_damaged_file_is_named_in_one_line(tmp_path, name):
    write_run(tmp_path, step=500)
    path = tmp_path / name
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    with pytest.raises(NoRunError, match=name):
        read_run(tmp_path)
