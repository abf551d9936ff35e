"""The page of the wire format: who builds the other end by its tables reads what our code writes."""

import re
import struct

import pytest

from protocol.link import datagrams as link
from protocol.link import direct
from protocol.link.datagrams import KEY_UP, DatagramKind, Sealer, bench_keys, hkdf
from protocol.link.reports import Code, Report, RequestState, encode_report
from protocol.tables import commands
from tools.make_dissector import TYPES
from tools.make_docs import wire

KEYS = bench_keys(7)
CODES = {name: code for code, name in TYPES.items()}
ROW = re.compile(r"^\| (\d+) \| `(\w+)` \| (\w+)(?: bytes)? \|$", re.MULTILINE)


def read(heading: str, data: bytes) -> dict[str, int | bytes]:
    """The fields that the page lists below a heading, by its offsets and types alone."""
    section = wire().split(f"\n## {heading}\n")[1].split("\n## ")[0]
    found = {}
    for at, name, form in ROW.findall(section):
        code = f"{form}s" if form.isdigit() else CODES[form]
        (found[name],) = struct.unpack_from(f"<{code}", data, int(at))
    return found


def test_a_datagram_and_its_telecommand_read_by_the_page_are_what_was_sealed():
    asked = commands.Telecommand(9, 5, 7, "goto", {"x_m": 1.0, "y_m": 2.0})
    datagram = Sealer(KEYS.command.key(2), 2, boot_id=3, counter=77).seal(
        DatagramKind.TELECOMMAND, commands.encode(asked)
    )
    assert read("Datagram", datagram) == {"kind": 4, "key_id": 2, "epoch": 0, "flags": 0, "counter": 77, "boot_id": 3}
    payload = datagram[16:-16]
    assert read("Telecommand, up", payload) == {
        "request_id": 9,
        "issued_ns": 5,
        "expiry_ns": 7,
        "start_ns": 0,
        "command": commands.command("goto").id,
    }


def test_a_report_read_by_the_page_is_what_was_encoded():
    payload = encode_report(Report(300, 2, 4, RequestState.FAILED, Code.MODE, "no", (1.5,)))
    assert read("Report, down", payload) == {
        "request_id": 300,
        "station": 2,
        "serial": 4,
        "state": 6,
        "code": 3,
        "values": 1,
    }
    assert "| `FAILED` | 6 |" in wire() and "| `MODE` | 3 |" in wire()


def test_a_hello_read_by_the_page_is_what_a_station_sends():
    hello = direct.Caller(KEYS, 2, 40).send(0)
    assert read("Words of a udp/ endpoint", hello) == {"word": 0x80, "key_id": 2, "nonce": 41, "cookie": bytes(16)}


@pytest.mark.parametrize(("info", "key"), [
    (b"el dorado link er2/u " + bytes((2, 0)), KEYS.command.key(2)),
    (b"el dorado link er2/u hello " + bytes((2,)), KEYS.command.hello_key(2)),
])  # fmt: skip
def test_keys_are_derived_as_the_page_says(info, key):
    assert hkdf(KEYS.command._secrets[2], info) == key and KEY_UP == "er2/u"
    assert int(re.search(r"at most (\d+) B", wire())[1]) == link.MAX_DATAGRAM
