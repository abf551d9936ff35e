"""The lock-step's messages cross a stream unchanged, however it is cut."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError
from protocol.barrier import Channel, Done, Hello, Receiver, Stop, Tick, Welcome, encode, parse_address

NAMES = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=20)
COUNTS = st.integers(0, 2**40)
CHANNELS = st.builds(
    Channel, NAMES, COUNTS, st.integers(0, 2), st.integers(0, 9), st.lists(COUNTS, max_size=5).map(tuple)
)
MESSAGES = st.one_of(
    st.builds(Hello, NAMES),
    st.builds(Welcome, COUNTS, COUNTS),
    st.builds(
        Tick,
        COUNTS,
        COUNTS,
        st.lists(CHANNELS, max_size=4).map(tuple),
        st.lists(st.floats(allow_nan=False), max_size=7).map(tuple),
    ),
    st.builds(Done, COUNTS, COUNTS, st.dictionaries(NAMES, COUNTS, max_size=4), st.lists(NAMES, max_size=3).map(tuple)),
    st.builds(Stop, NAMES),
)


@given(st.lists(MESSAGES, max_size=6), st.integers(1, 40))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_messages_come_out_as_they_went_in_for_any_cut(messages, cut):
    stream, receiver, out = b"".join(map(encode, messages)), Receiver(), []
    for at in range(0, len(stream), cut):
        out += receiver.receive(stream[at : at + cut])
    assert out == messages


def test_a_peer_of_another_version_is_refused_by_name_of_both_versions():
    raw = bytearray(encode(Hello("onboard")))
    raw[4] = 9
    with pytest.raises(WireError, match="version 9, this side 2"):
        Receiver().receive(bytes(raw))


def test_a_long_reason_of_a_stop_is_cut_not_lost():
    (message,) = Receiver().receive(encode(Stop("ä" * 300)))
    assert message.reason.startswith("ä" * 60)


@given(st.binary(min_size=1, max_size=60))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_noise_is_a_wire_error_and_nothing_else(body):
    for kind in range(1, 7):
        raw = (len(body) + 2).to_bytes(4, "little") + bytes([1, kind]) + body
        try:
            Receiver().receive(raw)
        except WireError:
            continue


@pytest.mark.parametrize("text", ["127.0.0.1:5", "tcp:host", "tcp::80", "udp:h:1"])
def test_a_wrong_address_is_refused_with_the_right_form(text):
    with pytest.raises(ValueError, match="tcp:HOST:PORT"):
        parse_address(text)


def test_an_address_is_host_and_port():
    assert parse_address("tcp:127.0.0.1:80") == ("127.0.0.1", 80)
