"""What the watcher knows of a run: read while it is written, and asked for any time of it."""

import shutil
import struct
from bisect import bisect_right

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from hil.records import Touch, TrueTurn
from hil.view.browser.player import Player
from hil.view.folder import Folder
from hil.view.story import STEP_M, Moment, PathSoFar, Story
from hil.view.tail import NoRunError, Tail
from hil.world.truth import Truth, read_turn
from tests.ground.synthetic_run import END_S, LEGS, SCAN_S, share_at, way, write_run, write_truth

pytestmark = pytest.mark.tool


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    write_run(folder, step=10)
    return folder


def story_of(folder):
    found = Folder(folder)
    found.read()
    return found.story


def test_a_record_that_grows_by_any_pieces_gives_each_message_once_and_in_order(run, tmp_path):
    whole = (run / "truth.mcap").read_bytes()
    with (run / "truth.mcap").open("rb") as file:
        rows = make_reader(file).iter_messages(log_time_order=False)
        messages = [(channel.topic, message.log_time / 1e9, message.data) for _, channel, message in rows]
    rng, path = np.random.default_rng(1), tmp_path / "truth.mcap"
    cuts = [0, 3, 7, *sorted(rng.integers(8, len(whole), 60).tolist()), len(whole)]
    tail, heard = Tail(path), []
    assert list(tail.read()) == []  # not there yet
    for end in cuts:
        path.write_bytes(whole[:end])
        assert not tail.finished
        heard += [(said.topic, said.time_s, said.data) for said in tail.read()]
    assert heard == messages
    assert tail.finished


def test_a_contact_is_told_once_when_it_begins(tmp_path):
    write_run(tmp_path, step=50, bench=False)
    write_truth(tmp_path / "truth.mcap", touches=[(20.0, 22.0, Touch(2, 0.09, (7.0, 3.0), (7.05, 3.1)))])
    told = [told for told in story_of(tmp_path).told if told.name == "contact"]
    assert told == [(20.0, "fault", "contact", "wheel 2 on a rock of 0.09 m at (7.05, 3.10)")]


def test_a_record_begun_anew_is_told(run, tmp_path):
    path = tmp_path / "truth.mcap"
    shutil.copy(run / "truth.mcap", path)
    path.write_bytes(path.read_bytes()[:-100])
    tail = Tail(path)
    list(tail.read())
    path.write_bytes(b"")
    with pytest.raises(NoRunError, match="was replaced"):
        list(tail.read())


def broken(data, how):
    return {
        "cut": lambda: data[: len(data) // 3],
        "noise": lambda: b"noise" * 20,
        "nothing": lambda: b"",
        "chunk": lambda: with_a_broken_chunk(data),
    }[how]()


def with_a_broken_chunk(record):
    at = 8  # behind the magic: each record is its kind, the length of the rest, the rest; 6 is a chunk
    while record[at] != 6:
        at += 9 + struct.unpack_from("<Q", record, at + 1)[0]
    middle = at + 9 + struct.unpack_from("<Q", record, at + 1)[0] // 2
    return record[:middle] + bytes(20) + record[middle + 20 :]


@pytest.mark.parametrize(
    ("name", "how"),
    [
        ("field.npz", "cut"),
        ("field.npz", "nothing"),
        ("truth.mcap", "noise"),
        ("truth.mcap", "chunk"),
        ("onboard.mcap", "noise"),
        ("onboard.mcap", "chunk"),
    ],
)
def test_a_damaged_file_is_named_in_one_line(run, tmp_path, name, how):
    shutil.copytree(run, tmp_path / "run")
    path = tmp_path / "run" / name
    path.write_bytes(broken(path.read_bytes(), how))
    with pytest.raises(NoRunError, match=f"{name} is damaged") as raised:
        story_of(path.parent)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("name", ["field.npz", "truth.mcap"])
def test_a_folder_without_a_run_is_one_line_that_says_what_makes_one(run, tmp_path, name):
    shutil.copytree(run, tmp_path / "run")
    (tmp_path / "run" / name).unlink()
    with pytest.raises(NoRunError, match=f"no .*{name}: `hil run`"):
        Folder(tmp_path / "run")


def test_a_run_that_was_cut_off_is_shown_as_far_as_it_is_written(run, tmp_path):
    shutil.copytree(run, tmp_path / "run")
    path = tmp_path / "run" / "truth.mcap"
    path.write_bytes(broken(path.read_bytes(), "cut"))
    found = Folder(path.parent)
    found.read()
    assert 10.0 < found.story.end_s < 40.0
    assert not found.finished


def test_a_turn_is_read_back_as_every_fourth_ray_that_met_something(tmp_path):
    rng = np.random.default_rng(2)
    origins, directions, ranges = rng.normal(size=(41, 3)), rng.normal(size=(41, 3)), rng.uniform(1, 30, 41)
    ranges[8] = np.inf
    truth = Truth(tmp_path / "truth.mcap")
    truth.add_turn(TrueTurn(10**9, 7, origins, directions, ranges))
    truth.add_turn(TrueTurn(10**9 + 25_000_000, 7, origins, directions, ranges))  # too soon: ten a second
    truth.close()
    (said,) = Tail(tmp_path / "truth.mcap").read()
    met = read_turn(said.data)
    kept = [k for k in range(0, 41, 4) if k != 8]
    np.testing.assert_allclose(met.points_m, [origins[k] + ranges[k] * directions[k] for k in kept], rtol=1e-6)
    np.testing.assert_allclose(met.origin_m, origins[20], rtol=1e-6)
    assert (said.topic, said.time_s, met.sweep) == ("/turn", 1.0, 7)


@given(st.floats(0, END_S + 5))
def test_at_any_time_the_rover_stands_where_it_truly_was_within_a_tenth_of_a_second(run_story, time_s):
    instant = run_story.at(time_s)
    last_s = min(int(time_s * 10 + 1e-9) / 10, END_S - 0.1)
    assert instant.moment.time_s == pytest.approx(last_s)
    assert instant.moment.position_m[:2] == pytest.approx(way(share_at(last_s))[:2])
    assert all(told.time_s <= time_s for told in instant.told)
    assert instant.plan_number == sum(start <= time_s for start, _ in LEGS)
    assert np.hypot(*(instant.way[-1] - instant.moment.position_m)[:2]) < 2 * STEP_M


@pytest.fixture(scope="module")
def run_story(run):
    return story_of(run)


def test_a_sweep_gathers_its_turns_and_the_drive_shows_the_last_one(run_story):
    start_s = LEGS[1][0]
    assert len(run_story.at(start_s - SCAN_S + 5.0).turns) == 51
    assert {met.sweep for met in run_story.at(start_s - 0.1).turns} == {2}
    driving = run_story.at(start_s + 3.0).turns
    assert [met.sweep for met in driving] == [0]
    assert run_story.at(END_S + 10.0).turns == ()


def test_a_fault_lasts_from_its_beginning_until_it_is_healed(run_story):
    begin_s, end_s = LEGS[1]
    lasting = {t: run_story.at(t).faults for t in (begin_s - 0.1, begin_s, end_s - 0.1, end_s)}
    assert list(lasting.values()) == [(), ("wheel_stuck 2",), ("wheel_stuck 2",), ()]
    assert ("fault", "begin", "wheel_stuck 2") in [told[1:] for told in run_story.at(begin_s).told]


def test_events_of_both_records_come_in_the_order_of_time(run_story):
    times = [told.time_s for told in run_story.told]
    assert times == sorted(times)
    assert {told.name for told in run_story.told} >= {"PHASE", "ARRIVED", "begin", "heal"}


def test_nothing_known_is_no_instant():
    assert Story().at(3.0) is None
    assert Story().end_s == 0.0


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=60), st.floats(0, 60))
def test_a_way_never_strays_from_where_the_rover_was(xs, time_s):
    drawn = PathSoFar()
    for k, x in enumerate(xs):
        drawn.add(float(k), (x, 0.0, 0.0))
    so_far = bisect_right(range(len(xs)), time_s)
    points = drawn.until(time_s)
    assert points[0][0] == xs[0]
    assert abs(points[-1][0] - xs[so_far - 1]) < STEP_M
    assert set(points[:, 0]) <= set(xs[:so_far])


# -- the player --------------------------------------------------------------------------------------------------------


def test_playing_goes_on_at_its_speed_and_stops_at_the_end():
    player = Player(speed=5.0)
    player.advance(0.4, 10.0)
    assert player.time_s == pytest.approx(2.0)
    player.advance(100.0, 10.0)
    assert player.time_s == 10.0


def test_a_held_player_stays_and_plays_on_from_there_or_from_the_start_when_at_the_end():
    player = Player(time_s=4.0)
    player.toggle(10.0)
    player.advance(1.0, 10.0)
    assert player.time_s == 4.0
    player.toggle(10.0)
    player.advance(1.0, 10.0)
    assert player.time_s == 9.0
    player.advance(9.0, 10.0)
    player.toggle(10.0)
    player.toggle(10.0)
    assert player.time_s == 0.0


def test_seeking_shows_that_time_and_ends_following():
    player = Player(following=True)
    player.advance(0.1, 33.0)
    assert player.time_s == 33.0
    player.seek(12.5)
    assert (player.time_s, player.following) == (12.5, False)
    player.follow(True)
    player.advance(0.1, 34.0)
    assert player.time_s == 34.0


def test_a_moment_after_another_is_the_end():
    story = Story()
    for time_s in (0.1, 0.2):
        story.add_moment(Moment(time_s, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0), (0.0,) * 4, (0.0,) * 4, ""))
    assert story.end_s == 0.2
    assert story.at(0.0).moment.time_s == 0.1  # before its first moment as in that one
