"""A record runs again to the same bytes; one that was changed is never called identical."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer

from onboard.__main__ import app
from onboard.core import snapshots
from onboard.record.reader import DamagedRecordError, open_record
from onboard.record.replay import replay
from onboard.record.replay_command import print_verdict
from onboard.record.schema import INPUTS, LAYOUTS, OUTPUTS
from onboard.record.writer import PART, register
from protocol.conventions import TICK_NS
from protocol.generated.can_codec import TABLE
from tests.onboard.record_rig import TICKS, fly, of_everything

ELSEWHERE = {"/in/record", "/in/registration"}  # in test_record_file, test_record_registrations
NAMED = re.compile(r"tick \d+, channel /\w+/\w+")


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return fly(tmp_path_factory.mktemp("record") / "onboard.mcap")[0]


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    """A record in which every input channel has something."""
    return fly(tmp_path_factory.mktemp("full") / "onboard.mcap", ticks=120, say=of_everything)[0]


@pytest.fixture(scope="module")
def ticks(full):
    """(tick, topic -> message) of it."""
    return list(open_record(full).ticks())


def packed(source, path, ticks, attached=()):
    """A valid file with other messages: every sum of the format fits. attached: (name, content) in place of its own."""
    with path.open("wb") as file:
        writer = Writer(file, enable_data_crcs=True)
        writer.start()
        writer.add_metadata(PART, {"number": "1", "first_tick": "1"})
        for name, data in {**open_record(source).attachments, **dict(attached)}.items():
            writer.add_attachment(0, 0, name, "", data)
        ids = register(writer)
        for number, messages in ticks:
            for topic, data in messages.items():
                writer.add_message(ids[topic], number * TICK_NS, data, number * TICK_NS, number)
        writer.finish()
    return path


def test_a_record_replays_to_the_same_bytes(record):
    verdict = replay(record)
    assert verdict.identical and verdict.first_difference == verdict.cut_off == ""
    assert verdict.ticks == TICKS
    assert verdict.bytes_compared["/out/tick"] > 0 and verdict.bytes_compared["/out/can"] > 0


def test_the_same_run_gives_the_same_file(record):
    before = record.read_bytes()
    assert fly(record)[0].read_bytes() == before


def test_an_output_that_the_core_would_not_make_is_named_by_tick_channel_and_field(tmp_path):
    def wrong(outputs):
        return replace(outputs, pose=(1e-9, *outputs.pose[1:]))

    verdict = replay(fly(tmp_path / "wrong.mcap", ticks=5, change=wrong)[0])
    assert not verdict.identical
    assert verdict.first_difference.startswith("tick 1, channel /out/pose, byte 0: recorded ")
    assert verdict.first_difference.endswith("; row 0, x_m: recorded 1e-09, now 0.0")
    assert print_verdict(tmp_path / "wrong.mcap", False, replay) == 1


def test_every_input_channel_has_something_in_the_record_that_is_tampered_with(ticks):
    found = {topic for _, messages in ticks for topic in messages}
    assert found >= set(INPUTS) - ELSEWHERE


def test_a_record_packed_anew_is_still_identical(full, ticks, tmp_path):
    assert replay(packed(full, tmp_path / "same.mcap", ticks)).identical


@pytest.mark.parametrize("topic", [topic for topic in INPUTS if topic not in ELSEWHERE])
@given(data=st.data())
@settings(max_examples=8, deadline=None, derandomize=True)
def test_a_flipped_bit_in_any_input_is_named_by_tick_and_channel(full, ticks, tmp_path_factory, topic, data):
    k = data.draw(st.sampled_from([k for k, (_, messages) in enumerate(ticks) if messages.get(topic)]))
    number, messages = ticks[k]
    changed = bytearray(messages[topic])
    bit = data.draw(st.integers(0, 8 * len(changed) - 1))
    changed[bit // 8] ^= 1 << bit % 8
    others = [*ticks[:k], (number, {**messages, topic: bytes(changed)}), *ticks[k + 1 :]]
    path = packed(full, tmp_path_factory.mktemp("flipped") / "flipped.mcap", others)
    with pytest.raises(DamagedRecordError, match=f"^tick {number}, channel {topic}: "):
        replay(path)


@pytest.mark.parametrize("topic", [topic for topic in OUTPUTS if topic not in ("/out/tick", "/out/disk")])
def test_a_flipped_bit_in_an_output_is_a_difference_with_tick_and_channel(full, ticks, tmp_path, topic):
    k = next(k for k, (_, messages) in enumerate(ticks) if messages.get(topic))
    number, messages = ticks[k]
    changed = bytes([messages[topic][0] ^ 1]) + messages[topic][1:]
    path = packed(full, tmp_path / "flipped.mcap", [*ticks[:k], (number, {**messages, topic: changed})])
    verdict = replay(path)
    assert not verdict.identical
    assert verdict.first_difference.startswith(f"tick {number}, channel {topic}, byte 0: recorded ")


def test_a_flipped_bit_in_a_digest_is_a_difference(full, ticks, tmp_path):
    number, messages = ticks[9]
    changed = bytes([messages["/out/tick"][0] ^ 1]) + messages["/out/tick"][1:]
    path = packed(full, tmp_path / "flipped.mcap", [*ticks[:9], (number, {**messages, "/out/tick": changed})])
    assert replay(path).first_difference.startswith("tick 10, channel /out/tick, byte 0: ")


def test_a_difference_of_the_state_names_the_first_item(record, monkeypatch):
    """A core whose speed is another in its last bit, from tick 7 on."""
    whole, calls = snapshots.state_items, iter(range(1, TICKS + 1))

    def other(rover):
        state = whole(rover)
        after = math.nextafter(state["localisation"][2], math.inf) if next(calls) >= 7 else state["localisation"][2]
        return {**state, "localisation": (*state["localisation"][:2], after, *state["localisation"][3:])}

    monkeypatch.setattr(snapshots, "state_items", other)
    verdict = replay(record)
    assert verdict.first_difference.startswith("tick 7, channel /out/tick, ")
    assert "localisation[2]" in verdict.first_difference


@pytest.mark.parametrize(("sources", "told"), [("", ""), ("0" * 64, "made by another program: commit c0ffee, this")])
def test_a_difference_tells_whether_another_program_made_the_record(full, ticks, tmp_path, sources, told):
    number, messages = ticks[9]
    flipped = bytes([messages["/out/tick"][0] ^ 1]) + messages["/out/tick"][1:]
    changed = [*ticks[:9], (number, {**messages, "/out/tick": flipped})]
    versions = json.loads(open_record(full).attachments["versions.json"])
    made = json.dumps({**versions, "commit": "c0ffee", "sources_sha256": sources or versions["sources_sha256"]})
    verdict = replay(packed(full, tmp_path / "other.mcap", changed, [("versions.json", made.encode())]))
    assert verdict.first_difference and verdict.another_program[: len(told) or None] == told


def test_an_input_that_is_left_out_or_added_is_named(full, ticks, tmp_path):
    number, messages = ticks[4]
    without = {topic: data for topic, data in messages.items() if topic != "/in/can"}
    with pytest.raises(DamagedRecordError, match=r"^tick 5, channel /in/can: "):
        replay(packed(full, tmp_path / "less.mcap", [*ticks[:4], (number, without)]))
    with pytest.raises(DamagedRecordError, match=r"^tick 5, channel /in/record: "):
        replay(packed(full, tmp_path / "more.mcap", [*ticks[:4], (number, {**messages, "/in/record": bytes(10)})]))


def test_ticks_that_are_left_out_are_named(full, ticks, tmp_path):
    with pytest.raises(DamagedRecordError, match=r"^tick 21: those after 10 are missing"):
        replay(packed(full, tmp_path / "gap.mcap", [*ticks[:10], *ticks[20:]]))


def test_a_tick_under_the_number_of_another_is_named(full, ticks, tmp_path):
    twice = [*ticks[:10], (11, ticks[9][1])]
    with pytest.raises(DamagedRecordError, match=r"^tick 11, channel /in/tick: it is of tick 10"):
        replay(packed(full, tmp_path / "twice.mcap", twice))


def test_a_replay_that_compares_nothing_fails(full, tmp_path, capsys):
    path = packed(full, tmp_path / "none.mcap", [])
    assert not replay(path).identical
    assert print_verdict(path, False, replay) == 1
    assert capsys.readouterr().out.startswith("nothing compared: 0 ticks")


def test_a_flipped_bit_anywhere_in_the_file_is_never_called_identical(record, tmp_path):
    whole = record.read_bytes()
    rng = np.random.default_rng(1)
    index = int.from_bytes(whole[-28:-20], "little")  # the footer's word of where the data ends and the index begins
    spread = rng.integers(0, index - 13, 60)  # before the 13 bytes of the data's end mark
    damaged = tmp_path / "damaged.mcap"
    for offset in spread.tolist():
        changed = bytearray(whole)
        changed[offset] ^= 1 << int(rng.integers(8))
        damaged.write_bytes(changed)
        try:
            verdict = replay(damaged)
        except DamagedRecordError as error:
            assert re.search(r"tick \d+|at its start", str(error)), offset
        else:
            assert not verdict.identical and NAMED.search(verdict.first_difference), offset


def test_each_channel_says_how_it_reads(record):
    with record.open("rb") as file:
        summary = make_reader(file).get_summary()
    texts = {summary.schemas[c.schema_id].data.decode() for c in summary.channels.values()}
    assert texts == set(LAYOUTS.values())


# -- the command ---------------------------------------------------------------------------------------------------


def test_the_command_prints_the_verdict_and_exits_0(record, capsys):
    assert print_verdict(record, True, replay) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["verdict"], told["ticks"], told["first_difference"]) == ("identical", TICKS, "")
    assert print_verdict(record, False, replay) == 0
    assert capsys.readouterr().out.startswith(f"identical: {TICKS} ticks; bytes compared: /out/tick ")


def test_a_record_that_is_not_there_exits_66(tmp_path, capsys):
    assert print_verdict(tmp_path / "none.mcap", False, replay) == 66
    assert capsys.readouterr().err == f"onboard: no record {tmp_path / 'none.mcap'}\n"


def run(words, capsys):
    """Exit code, standard output, standard error of the command."""
    with pytest.raises(SystemExit) as ended:
        app([str(word) for word in words], prog_name="onboard")
    return ended.value.code or 0, *capsys.readouterr()


def test_another_configuration_gives_a_report_in_place_of_a_verdict(record, capsys):
    code, out, _ = run(["replay", "--set", "link.rate_bps=2000", "--json", record], capsys)
    told = json.loads(out)
    assert code == 0 and "verdict" not in told
    assert told["ticks"] == TICKS
    assert told["settings"] == {"link.rate_bps": ["256000.0", "2000.0"]}
    assert told["channels"]["/out/link"]["ticks"] > 0 and told["channels"]["/out/link"]["first_tick"] > 0
    assert told["channels"]["/out/can"] == {"ticks": 0, "first_tick": 0, "first": ""}


def test_the_report_names_the_events_that_only_one_of_the_runs_has(tmp_path, capsys):
    def silent_for_100_ms(inputs):
        kept = tuple(frame for frame in inputs.can_frames if TABLE[frame.can_id].sender != "WHEEL_1")
        return replace(inputs, can_frames=kept) if 150 <= inputs.tick < 160 else inputs

    path = fly(tmp_path / "silent.mcap", say=silent_for_100_ms, settings={"can.silent_ns": 200_000_000})[0]
    code, out, _ = run(["replay", "--set", "can.silent_ns=50000000", path], capsys)
    assert code == 0
    assert re.search(r"^event      only now: 1\.\d+ s FAULT WHEEL_SILENT", out, re.MULTILINE), out
    assert "only recorded" not in out


def test_a_setting_that_is_none_ends_with_78_and_says_so(record, capsys):
    code, out, err = run(["replay", "--set", "rover.mass=30", record], capsys)
    assert (code, out) == (78, "") and "rover.mass" in err and err.count("\n") == 1


def test_the_same_configuration_gives_a_report_of_no_difference(record, tmp_path, capsys):
    own = tmp_path / "own.toml"
    own.write_bytes(open_record(record).attachments["config.toml"])
    code, out, _ = run(["replay", "--with-config", own, record], capsys)
    assert code == 0 and "setting    none differs" in out
    assert all("the same in every tick" in line for line in out.splitlines() if line.startswith("/out/"))
