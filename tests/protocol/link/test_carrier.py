"""The opening of a link end on its carrier, without a carrier."""

import json

from protocol.link.carrier import PROBE_PERIOD_NS, READY, Probe, settings


def test_probes_are_numbered_and_repeated_every_20_ms_until_answered():
    probe = Probe()
    assert probe.send(0) == b"probe 1"
    assert probe.send(PROBE_PERIOD_NS - 1) is None
    assert probe.send(PROBE_PERIOD_NS) == b"probe 2"
    assert not probe.open
    assert probe.receive(b"probe 1") == READY
    assert probe.open
    assert probe.send(10 * PROBE_PERIOD_NS) is None
    assert probe.receive(b"probe 2") is None


def test_answers_to_nobodys_questions_do_not_open():
    probe = Probe()
    probe.send(0)
    for words in (b"", b"probe", b"probe 0", b"probe 2", b"probe x", READY, b"\xff probe 1"):
        assert probe.receive(words) is None
    assert not probe.open


def test_a_session_searches_for_nobody():
    rows = {key: json.loads(text) for key, text in settings(connect="tcp/127.0.0.1:7447")}
    assert rows["scouting/multicast/enabled"] is False
    assert rows["scouting/gossip/enabled"] is False
    assert rows["connect/endpoints"] == ["tcp/127.0.0.1:7447"]
    assert rows["listen/endpoints"] == []
