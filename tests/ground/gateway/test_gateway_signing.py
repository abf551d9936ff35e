"""The signed door: what is forged, replayed or unsigned changes nothing, and the genuine sender always gets through."""

import hashlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.gateway.clients import Door
from ground.gateway.frames import mavlink as m
from ground.gateway.shell import Marks, read_signing_key
from ground.gateway.signing import STAMPS_PER_S, Verifier
from onboard.config import ConfigError
from protocol import WireError
from tests.ground.gateway_bed import GUI, NOON, OPEN, Bed

KEY, OTHER = hashlib.sha256(b"a key").digest(), hashlib.sha256(b"another").digest()
STOP = m.MAVLink_command_long_message(1, 1, m.MAV_CMD_COMPONENT_ARM_DISARM, 0, *[0.0] * 7)


def signer(key: bytes = KEY, stamp: int = NOON, link: int = 3, system: int = 255) -> m.MAVLink:
    """pymavlink's own sender: an independent maker of signatures."""
    sender = m.MAVLink(None, srcSystem=system, srcComponent=190)
    sender.signing.secret_key, sender.signing.link_id, sender.signing.timestamp = key, link, stamp
    sender.signing.sign_outgoing = True
    return sender


def verdict(verifier: Verifier, frame: bytes, now: int = NOON) -> str:
    try:
        verifier.check(frame, now)
    except WireError as error:
        return error.kind
    return "ok"


def a_bed(kept=None) -> Bed:
    bed = Bed(Door("signed", Verifier(KEY, kept), KEY))
    bed.step(1.0)
    return bed


def test_a_signed_stop_is_obeyed_and_answered_in_signed_frames():
    bed = a_bed()
    assert bed.receive(STOP.pack(signer(stamp=bed.stamp))) == 1
    bed.step(1.0)
    assert bed.rover.executed == ["stop"]
    reader = m.MAVLink(None)
    reader.signing.secret_key, reader.signing.timestamp = KEY, NOON
    bed.receive(STOP.pack(signer(stamp=bed.stamp)))
    bed.gateway.turn([], bed.now_ns)
    bed.step(1.5)
    answers = [one.get_msgbuf() for to, one in bed.said if to == GUI]
    assert answers
    for frame in answers:
        assert verdict(Verifier(KEY), bytes(frame), bed.stamp) == "ok"


@pytest.mark.parametrize("what", ["unsigned", "wrong key", "flipped payload", "flipped signature", "flipped time"])
def test_what_is_not_genuine_does_nothing_and_makes_nobody_known(what):
    bed = a_bed()
    frame = bytearray(STOP.pack(signer(OTHER if what == "wrong key" else KEY, bed.stamp)))
    if what == "unsigned":
        frame = bytearray(STOP.pack(m.MAVLink(None, srcSystem=255, srcComponent=190)))
    at = {"flipped payload": 12, "flipped signature": len(frame) - 1, "flipped time": len(frame) - 8}.get(what)
    if at is not None:
        frame[at] ^= 1
    assert bed.receive(bytes(frame)) == 0
    bed.step(1.0)
    assert bed.rover.executed == []
    assert bed.gateway.clients.known == ()
    assert bed.kept is None


def test_a_forged_frame_from_the_future_does_not_lock_the_genuine_sender_out():
    """pymavlink's own check stores the time before it verifies: here the same frames pass it and us."""
    forged = STOP.pack(signer(OTHER, NOON + 50 * STAMPS_PER_S))
    genuine = STOP.pack(signer(KEY, NOON))
    theirs = m.MAVLink(None)
    theirs.signing.secret_key, theirs.signing.timestamp = KEY, NOON
    assert not theirs.check_signature(bytearray(forged), 255, 190)
    assert not theirs.check_signature(bytearray(genuine), 255, 190)  # why it must not be relied on
    ours = Verifier(KEY)
    assert verdict(ours, bytes(forged)) == "signature"
    assert verdict(ours, bytes(genuine)) == "ok"


def test_a_captured_frame_is_refused_at_once_and_after_a_restart_and_the_genuine_client_goes_on():
    bed = a_bed()
    client = signer(stamp=bed.stamp)
    captured = STOP.pack(client)
    assert [bed.receive(captured), bed.receive(captured)] == [1, 0]
    assert bed.gateway.clients.counts["replay"] == 1
    again = a_bed(kept=bed.kept)
    assert again.receive(captured) == 0
    again.step(1.0)
    assert again.rover.executed == []
    assert again.receive(STOP.pack(client)) == 1  # its next frame, one count on
    again.step(1.0)
    assert again.rover.executed == ["stop"]


def test_marks_are_there_before_a_frame_is_acted_upon():
    bed = a_bed()
    heard = bed.gateway.clients.accept(bed.door, GUI, STOP.pack(signer(stamp=bed.stamp)), bed.stamp)
    assert bed.gateway.clients.marks() == {"3/255/190": bed.stamp}
    assert bed.gateway.clients.marks() is None  # told once
    assert bed.session.requester.open == 0
    bed.gateway.act(heard[0], bed.now_ns)
    assert bed.session.requester.open == 1


def test_a_new_stream_may_be_a_minute_old_and_no_frame_a_minute_ahead():
    minute = 60 * STAMPS_PER_S
    for offset, expected in ((-minute, "ok"), (-minute - 1, "clock"), (minute, "ok"), (minute + 1, "clock")):
        assert verdict(Verifier(KEY), bytes(STOP.pack(signer(stamp=NOON + offset)))) == expected


def test_streams_are_told_apart_by_link_system_and_component():
    verifier = Verifier(KEY)
    for link, system in ((3, 255), (4, 255), (3, 254)):
        assert verdict(verifier, bytes(STOP.pack(signer(link=link, system=system)))) == "ok"
        assert verdict(verifier, bytes(STOP.pack(signer(link=link, system=system)))) == "replay"


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.integers(-100, 100), st.booleans()), max_size=30))
def test_a_stream_s_accepted_times_only_rise_and_forged_ones_leave_no_trace(frames):
    verifier, clean, accepted = Verifier(KEY), Verifier(KEY), []
    for offset, genuine in frames:
        frame = bytes(STOP.pack(signer(KEY if genuine else OTHER, NOON + offset)))
        got = verdict(verifier, frame)
        assert got == (verdict(clean, frame) if genuine else "signature")
        if got == "ok":
            accepted.append(offset)
    assert accepted == sorted(set(accepted))


def test_the_unsigned_door_beside_it_takes_no_notice_of_signatures():
    bed = a_bed()
    assert bed.receive(STOP.pack(signer(OTHER, bed.stamp)), door=OPEN) == 1


def test_marks_outlive_the_program_and_a_damaged_file_is_refused(tmp_path):
    marks = Marks(tmp_path / "state" / "gateway-signing.json")
    assert marks.read() == {}
    marks.keep({"3/255/190": NOON})
    assert Marks(tmp_path / "state" / "gateway-signing.json").read() == {"3/255/190": NOON}
    (tmp_path / "state" / "gateway-signing.json").write_text('["no"]')
    with pytest.raises(ConfigError, match="damaged"):
        marks.read()


def test_a_key_file_is_hex_or_a_passphrase_and_only_its_owner_reads_it(tmp_path):
    path = tmp_path / "key"
    for text, key in ((KEY.hex() + "\n", KEY), ("passphrase a key\n", KEY)):
        path.write_text(text)
        path.chmod(0o600)
        assert read_signing_key(str(path)) == key
    path.chmod(0o640)
    with pytest.raises(ConfigError, match="mode 0640, others may read this key"):
        read_signing_key(str(path))
    path.chmod(0o600)
    path.write_text("secret words")
    with pytest.raises(ConfigError, match="64 hex digits") as error:
        read_signing_key(str(path))
    assert "secret words" not in str(error.value)
    with pytest.raises(ConfigError, match="No such file"):
        read_signing_key(str(tmp_path / "none"))
