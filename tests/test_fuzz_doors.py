"""A short round of the fuzz of the station's doors; `python -m tests.fuzz_doors` goes on for as long as asked."""

import pytest

from ground.session.session import Session
from protocol import WireError, bulk_wire
from protocol import eldorado_dialect as dialect
from protocol.link import DOWNLINK_KEY_ID, Kind, Sealer, bench_keys
from protocol.reports import Report, State, encode_report
from tests.fuzz_doors import DOORS, tries

FEW = {"products": 1500, "forged": 300, "datagrams": 30, "gateway": 15, "archive": 60}


@pytest.mark.parametrize("door", DOORS)
def test_hostile_bytes_at_a_door_give_documented_errors_alone(door):
    tries(door, 7, 0, FEW[door])


def test_a_try_that_fails_names_the_command_that_repeats_it(monkeypatch):
    monkeypatch.setitem(DOORS, "products", lambda rng: 1 // 0)
    with pytest.raises(AssertionError, match=r"ZeroDivisionError.*tests.fuzz_doors products --seed 3 --first 5"):
        tries("products", 3, 5, 1)


def insider() -> tuple[Session, Sealer]:
    keys = bench_keys(7)
    return Session(keys, 1), Sealer(keys.downlink.key(DOWNLINK_KEY_ID), DOWNLINK_KEY_ID, 1)


def test_an_angle_that_is_infinite_is_one_refused_datagram():
    session, sealer = insider()
    raw = dialect.MAVLink_attitude_message(1, 0.0, 0.0, float("inf"), 0.0, 0.0, 0.0).pack(dialect.MAVLink(None))
    assert session.receive(sealer.seal(Kind.MAVLINK, bytes(raw)), 0) == ("mavlink", [])


@pytest.mark.parametrize("named", [float("nan"), float("inf"), -1.0, 0.5])
def test_a_report_that_names_no_object_brings_no_product(named):
    session, sealer = insider()
    asked = session.request("get", {"product": "ldem"}, 0)
    report = encode_report(Report(asked, 1, 1, State.COMPLETED, 0, "", (named,)))
    assert session.receive(sealer.seal(Kind.REPORT, report), 0)[0] == "ok"
    assert session.product_of(asked) is None


def test_an_object_of_more_chunks_than_there_are_numbers_is_refused():
    with pytest.raises(WireError, match="chunks"):
        bulk_wire.announced(bulk_wire.ANNOUNCE.pack(2**26, 1, bytes(32), 4, 4) + b"ldemjson")
    assert bulk_wire.announced(bulk_wire.ANNOUNCE.pack(2**26, 1100, bytes(32), 4, 4) + b"ldemjson")[1] == 1100
