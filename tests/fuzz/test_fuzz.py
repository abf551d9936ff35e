"""A short round of the fuzz of every door; `python -m tests.fuzz` goes on for as long as asked."""

import pytest

from ground.link.session import Session
from onboard.devices.emergency import reason_name
from onboard.record.made_by import versions
from onboard.record.reader import DamagedRecordError, open_record
from onboard.records import Frame
from protocol import WireError
from protocol.generated import eldorado_dialect as dialect
from protocol.generated.can_codec import TABLE, TiltState
from protocol.link import bulk_wire
from protocol.link.datagrams import DOWNLINK_KEY_ID, DatagramKind, Sealer, bench_keys
from protocol.link.reports import Report, RequestState, encode_report
from tests.fuzz import guided
from tests.fuzz.__main__ import main
from tests.fuzz.blind import feed, tries
from tests.fuzz.door import Door, join, split
from tests.fuzz.doors import DOORS
from tests.fuzz.doors.rover import Standing
from tests.onboard import record_rig

FEW = {"products": 1500, "barrier": 600, "datagrams": 300, "gdem": 300, "socketcand": 300}


@pytest.mark.tool
@pytest.mark.parametrize("name", DOORS)
def test_hostile_bytes_at_a_door_give_documented_errors_alone(name):
    tries(DOORS, name, 7, 0, FEW.get(name, 60))


@pytest.mark.parametrize("name", DOORS)
def test_what_the_fuzz_has_kept_gives_documented_errors_alone(name):
    kept = guided.kept(name)
    assert kept
    for data in kept:
        feed(DOORS[name], data)


def test_a_try_that_fails_names_the_command_that_repeats_it():
    broken = {"products": Door(lambda rng: b"", lambda data: 1 // 0)}
    with pytest.raises(AssertionError, match=r"ZeroDivisionError.*tests.fuzz products --blind --seed 3 --first 5"):
        tries(broken, "products", 3, 5, 1)


def test_the_command_repeats_a_file_and_names_the_doors_there_are(tmp_path, capsys):
    (tmp_path / "found").write_bytes(b"\x00\x01")
    assert main(["barrier", "--file", str(tmp_path / "found")]) == 0
    with pytest.raises(SystemExit) as ended:
        main(["barrier", "no-door"])
    assert ended.value.code == 2 and "barrier" in capsys.readouterr().err


def test_a_door_at_which_nothing_was_tried_is_no_success(monkeypatch, capsys):
    monkeypatch.setattr(guided, "available", lambda: True)
    monkeypatch.setattr(guided, "run", lambda *_: guided.Ended(0, 3, 80, None, ""))
    assert main(["barrier"]) == 1 and "no try" in capsys.readouterr().out


def test_messages_that_are_joined_are_split_again_and_any_bytes_can_be_split():
    parts = [b"", b"a", bytes(300)]
    assert split(join(parts)) == parts
    assert split(join([b"abc"])[:-1]) == [b"ab"] and split(b"\xff") == []


# -- what the fuzz has found -----------------------------------------------------------------------------------------


def frame_of(name, *values):
    row = next(row for row in TABLE.values() if row.name == name)
    return Frame(row.can_id, row.encode(*values, 1), 0)  # counter 1: the node itself has said 0


def test_a_tilt_node_that_tells_a_state_the_dbc_does_not_have_is_no_end_of_the_tick():
    core = Standing()
    core.tick((frame_of("TILT_FEEDBACK", 1, 0.0, 0.0, 12),))
    assert core.rover.nodes.tilt.state is TiltState.OFF
    core.must_stop()


def test_a_stop_for_a_reason_the_dbc_does_not_have_is_told_by_its_number():
    assert (reason_name(77), reason_name(3)) == ("77", "BUTTON")


def test_a_damaged_attachment_of_a_record_is_told_by_name(tmp_path):
    path, *_ = record_rig.fly(tmp_path / "r.mcap", ticks=20)
    raw = bytearray(path.read_bytes())
    raw[raw.index(b'"python"')] ^= 1
    (tmp_path / "damaged.mcap").write_bytes(raw[:-40])  # cut off, so that the file's own checksum is missing
    with pytest.raises(DamagedRecordError, match=r"versions.json"):
        open_record(tmp_path / "damaged.mcap")


@pytest.mark.parametrize("told", [b"[]", b"\xff", b"[" * 9000, b'{"commit": {"a": 1}}'])
def test_a_record_that_does_not_tell_what_made_it_is_read_all_the_same(told):
    assert all(isinstance(word, str) for word in versions({"versions.json": told}).values())


def insider() -> tuple[Session, Sealer]:
    keys = bench_keys(7)
    return Session(keys, 1), Sealer(keys.downlink.key(DOWNLINK_KEY_ID), DOWNLINK_KEY_ID, 1)


def test_an_angle_that_is_infinite_is_one_refused_datagram():
    session, sealer = insider()
    raw = dialect.MAVLink_attitude_message(1, 0.0, 0.0, float("inf"), 0.0, 0.0, 0.0).pack(dialect.MAVLink(None))
    assert session.receive(sealer.seal(DatagramKind.MAVLINK, bytes(raw)), 0) == ("mavlink", [])


@pytest.mark.parametrize("named", [float("nan"), float("inf"), -1.0, 0.5])
def test_a_report_that_names_no_object_brings_no_product(named):
    session, sealer = insider()
    asked = session.request("get", {"product": "ldem"}, 0)
    report = encode_report(Report(asked, 1, 1, RequestState.COMPLETED, 0, "", (named,)))
    assert session.receive(sealer.seal(DatagramKind.REPORT, report), 0)[0] == "ok"
    assert session.product_of(asked) is None


def test_an_object_of_more_chunks_than_there_are_numbers_is_refused():
    with pytest.raises(WireError, match="chunks"):
        bulk_wire.announced(bulk_wire.ANNOUNCE.pack(2**26, 1, bytes(32), 4, 4) + b"ldemjson")
    assert bulk_wire.announced(bulk_wire.ANNOUNCE.pack(2**26, 1100, bytes(32), 4, 4) + b"ldemjson")[1] == 1100
