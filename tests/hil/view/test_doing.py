"""The line of a run names the rover's mode and phase as its record tells them."""

import json

import pytest
from mcap.writer import Writer

from hil.view.doing import Doing, after


@pytest.mark.parametrize(("events", "words"), [
    ([("MODE", "BOOT -> STANDBY: booted")], "STANDBY"),
    ([("MODE", "STANDBY -> AUTONOMOUS: goal 8.00 3.00"), ("PHASE", "SCANNING at stop 0")], "AUTONOMOUS scanning"),
    ([("MODE", "STANDBY -> AUTONOMOUS: goal"), ("PHASE", "DRIVING at stop 1"), ("MODE", "AUTONOMOUS -> STANDBY: stop")],
     "STANDBY"),
    ([("MODE", "BOOT -> STANDBY"), ("MODE", "STANDBY -> NOWHERE"), ("PHASE", "DANCING")], "STANDBY"),
])  # fmt: skip
def test_mode_and_phase_follow_the_events(events, words):
    state = ("BOOT", "")
    for name, text in events:
        state = after(*state, name, text)
    assert " ".join(state).strip() == words


def record(path, *events):
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/out/event", "json", writer.register_schema("e", "jsonschema", b"{}"))
        rows = [{"now_ns": 0, "severity": "info", "name": name, "text": text} for name, text in events]
        writer.add_message(channel, 5, json.dumps(rows).encode(), 5)
        writer.finish()


def test_the_words_come_from_the_record_and_begin_anew_with_the_next_boot(tmp_path):
    doing = Doing(tmp_path)
    assert doing.words() == ""
    record(tmp_path / "onboard.mcap", ("MODE", "STANDBY -> AUTONOMOUS: x"), ("PHASE", "DRIVING at stop 1"))
    assert doing.words() == "AUTONOMOUS driving" == doing.words()
    (tmp_path / "onboard.mcap").rename(tmp_path / "onboard-boot1.mcap")
    record(tmp_path / "onboard.mcap", ("MODE", "BOOT -> STANDBY: booted"))
    assert doing.words() == "STANDBY"


def test_a_record_that_is_damaged_gives_no_words(tmp_path):
    (tmp_path / "onboard.mcap").write_bytes(b"noise, more than a magic")
    assert Doing(tmp_path).words() == ""
