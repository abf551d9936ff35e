"""The datagram: what opens, and that nothing else does."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError
from protocol.link import datagrams as link

COMMAND, DOWNLINK = link.bench_keys(7)


def sealer(station: int = 1, boot_id: int = 5, counter: int = 0, epoch: int = 0) -> link.Sealer:
    key = COMMAND.key(station, epoch)
    assert key is not None
    return link.Sealer(key, station, boot_id, counter, epoch)


def rover(boot_id: int = 5) -> link.Opener:
    return link.Opener(COMMAND, boot_id=boot_id)


def refusal(opener: link.Opener, datagram: bytes) -> str:
    with pytest.raises(WireError) as caught:
        opener.open(datagram)
    return caught.value.kind


def test_what_was_sealed_opens_with_kind_station_counter_and_boot_id():
    opened = rover().open(sealer(3, counter=9).seal(link.DatagramKind.TELECOMMAND, b"abc"))
    assert opened == (link.DatagramKind.TELECOMMAND, 3, 9, 5, b"abc", False)


def test_header_and_tag_take_32_bytes_at_most_48():
    assert link.OVERHEAD == 32
    assert len(sealer().seal(1, b"")) == 32


def test_the_frame_is_as_drawn_with_an_hmac_computed_apart():
    import hmac

    datagram = sealer(2, 0x01020304, 7).seal(link.DatagramKind.REPORT, b"xyz")
    assert datagram[:16] == bytes([5, 2, 0, 0]) + (7).to_bytes(8, "little") + bytes([4, 3, 2, 1])
    key = COMMAND.key(2)
    assert key is not None
    assert datagram[19:] == hmac.new(key, datagram[:19], "sha256").digest()[:16]


def test_hkdf_agrees_with_the_second_and_third_vectors_of_rfc_5869():
    out = link.hkdf(bytes([0x0B] * 22), b"", 42)  # A.3: no salt, no info
    assert out.hex() == ("8da4e775a563c18f715f802a063c5a31b8a11f5c5ee1879ec3454e5f3c738d2d9d201395faa4b61a96c8")


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.binary(max_size=200), st.data())
def test_any_single_changed_bit_is_refused(payload, data):
    datagram = bytearray(sealer().seal(2, payload))
    bit = data.draw(st.integers(0, 8 * len(datagram) - 1))
    datagram[bit // 8] ^= 1 << bit % 8
    opener = rover()
    assert refusal(opener, bytes(datagram)) == "tag"
    assert opener.open(sealer().seal(2, payload)).payload == payload


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.binary(max_size=1300))
def test_noise_is_refused_and_never_raises_anything_but_a_wire_error(noise):
    assert refusal(rover(), noise) in ("length", "tag")


def test_a_truncated_datagram_is_refused_at_every_length():
    datagram, opener = sealer().seal(2, b"payload"), rover()
    assert {refusal(opener, datagram[:n]) for n in range(len(datagram))} == {"length", "tag"}


def test_100000_forged_replayed_and_foreign_frames_are_refused_and_the_genuine_sender_is_unaffected():
    opener, mine, generator = rover(), sealer(), np.random.default_rng(1)
    down = DOWNLINK.key(0)
    assert down is not None
    cross, old_boot, old_epoch = link.Sealer(down, 0, 5), sealer(boot_id=4), sealer(epoch=1)
    refused: dict[str, int] = {}
    for n in range(2_000):
        genuine = mine.seal(4, struct.pack("<I", n))
        assert opener.open(genuine).counter == n
        forged = bytearray(genuine)
        forged[4:12] = int(generator.integers(0, 2**63)).to_bytes(8, "little")
        bad = [bytes(forged), genuine, cross.seal(4, b""), old_boot.seal(4, b""), old_epoch.seal(4, b"")] * 10
        for datagram in bad:
            kind = refusal(opener, datagram)
            refused[kind] = refused.get(kind, 0) + 1
    assert refused == {"tag": 40_000, "copy": 6_000, "replay": 14_000, "boot": 20_000, "epoch": 20_000}


def test_a_downlink_datagram_does_not_open_at_the_rover_even_where_both_directions_share_a_secret():
    secret = bytes(range(32))
    up, down = link.Keyring(link.KEY_UP, {1: secret}), link.Keyring(link.KEY_DOWN, {1: secret})
    key = down.key(1)
    assert key is not None
    assert refusal(link.Opener(up, boot_id=5), link.Sealer(key, 1, 5).seal(4, b"")) == "tag"


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.permutations(list(range(60))))
def test_any_order_within_the_window_opens_once_each(order):
    mine, opener = sealer(counter=1000), rover()
    datagrams = [mine.seal(1, bytes([n])) for n in range(60)]
    assert [opener.open(datagrams[n]).payload[0] for n in order] == order
    assert {refusal(opener, d) for d in datagrams} == {"copy"}


def test_the_window_holds_4096_counters():
    mine, opener = sealer(), rover()
    datagrams = [mine.seal(1, b"") for _ in range(4098)]
    opener.open(datagrams[4097])
    assert refusal(opener, datagrams[1]) == "replay"
    assert opener.open(datagrams[2]).counter == 2
    assert [refusal(opener, datagrams[2]) for _ in range(5)] == ["copy"] * 3 + ["replay"] * 2


def test_a_copy_is_told_from_a_replay_by_the_newest_256_that_were_accepted():
    mine, opener = sealer(), rover()
    datagrams = [mine.seal(1, b"") for _ in range(257)]
    for datagram in datagrams[:256]:
        opener.open(datagram)
    assert refusal(opener, datagrams[0]) == "copy"
    opener.open(datagrams[256])
    assert refusal(opener, datagrams[0]) == "replay"
    assert refusal(opener, datagrams[1]) == "copy"


def test_what_was_never_accepted_has_no_copies():
    mine, opener = sealer(counter=10), rover()
    late = sealer(counter=9).seal(1, b"")
    opener.heard_before(1, 10)
    assert [refusal(opener, d) for d in (late, late, mine.seal(1, b""))] == ["replay"] * 3


def test_a_jump_over_two_to_the_20_is_refused_and_one_of_it_opens():
    opener = rover()
    opener.open(sealer(counter=0).seal(1, b""))
    assert refusal(opener, sealer(counter=2**20 + 1).seal(1, b"")) == "jump"
    assert opener.open(sealer(counter=2**20).seal(1, b"")).counter == 2**20


def test_each_station_has_its_own_window():
    opener = rover()
    assert [opener.open(sealer(s).seal(1, b"")).station for s in (1, 2, 3)] == [1, 2, 3]


def test_the_ground_takes_the_newest_boot_and_refuses_the_older():
    key = DOWNLINK.key(0)
    assert key is not None
    ground = link.Opener(DOWNLINK)
    first = link.Sealer(key, 0, 3)
    one, two = first.seal(1, b"1"), first.seal(1, b"2")
    ground.open(one)
    ground.open(link.Sealer(key, 0, 4).seal(1, b"new boot, counter 0 again"))
    assert ground.boot_id == 4
    assert refusal(ground, two) == "boot"
    assert refusal(ground, one) == "boot"


def test_a_key_file_reads_back_and_its_errors_name_the_line_but_no_secret():
    text = link.format_keys(link.KEY_UP, {1: bytes(32), 2: bytes(range(32))}, (0, 1))
    keys = link.parse_keys("# stations\n" + text)
    assert (keys.key_ids, keys.epochs, keys.direction) == ((1, 2), (0, 1), link.KEY_UP)
    with pytest.raises(ValueError, match="line 2") as caught:
        link.parse_keys("epoch 0\ner2/u 1 " + "ab" * 32 + " x\n")
    assert "abab" not in str(caught.value)
    assert "00" not in repr(keys)


@pytest.mark.parametrize(("rate_bps", "limit"), [(16e3, 200), (64e3, 800), (92e3, 1150), (1e8, 1150)])
def test_a_datagram_takes_at_most_a_tenth_of_a_second_of_the_line(rate_bps, limit):
    assert link.datagram_limit(rate_bps) == limit


def test_a_payload_leaves_room_for_frame_and_tag_and_costs_udp_and_ip_on_the_line():
    assert link.payload_limit(64e3) == 800 - 16 - 16
    assert link.line_bytes(100) == 100 + 16 + 16 + 8 + 20


def test_the_longest_datagram_opens_and_one_byte_more_is_refused():
    longest = sealer().seal(1, bytes(1150 - 32))
    assert refusal(rover(), longest + b"\0") == "length"
    assert len(rover().open(longest).payload) == 1118


def test_every_kind_opens_and_the_numbers_beside_them_do_not():
    assert [rover().open(sealer().seal(kind, b"")).kind for kind in range(1, 6)] == list(link.DatagramKind)
    assert [refusal(rover(), sealer().seal(kind, b"")) for kind in (0, 6)] == ["kind", "kind"]


def test_key_ids_and_epochs_are_bytes():
    assert link.Keyring(link.KEY_UP, {0: bytes(32), 255: bytes(32)}, (0, 255)).key(255, 255)
    for secrets, epochs in (
        ({256: bytes(32)}, (0,)),
        ({-1: bytes(32)}, (0,)),
        ({1: bytes(31)}, (0,)),
        ({1: bytes(32)}, (256,)),
        ({1: bytes(32)}, (-1,)),
    ):
        with pytest.raises(ValueError, match="a keyring needs"):
            link.Keyring(link.KEY_UP, secrets, epochs)


def test_a_payload_that_does_not_fit_is_our_own_error():
    assert len(sealer().seal(1, bytes(1150 - 32))) == 1150
    with pytest.raises(ValueError, match="at most 1118"):
        sealer().seal(1, bytes(1119))
