"""Texts from outside on the operator's screen: control characters are visible, products are checked before use."""

import json
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from ground.__main__ import run
from ground.archive.store import Archive
from ground.cli.operations.bars import Bars
from ground.cli.operations.show import news_json, news_line, way_words
from ground.cli.shell import terminal
from ground.cli.verbs import keys
from ground.cli.verbs.run_verb import last_words
from ground.cli.verbs.screen import line_beside, line_out, text_out
from ground.link.news import ProductHeard, Progress
from ground.link.telemetry import TelemetryReceiver
from ground.report.page import facts, page, paragraph, table
from protocol import WireError, scip
from protocol.generated import eldorado_dialect as dialect
from protocol.link import bulk_wire
from protocol.link.bulk import Product
from protocol.link.reports import Report, RequestState, decode_report, encode_report
from protocol.visible import visible, visible_lines

ROOT = Path(__file__).parents[3]
HOSTILE = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202etxt\r\n 99.00 s  info      ARRIVED: forged\x00\x7f\ud800\u2028"


def clean(text: str) -> bool:
    return all(c.isprintable() or c in "\n\t" for c in text)


def test_control_characters_become_visible_and_nothing_else_changes():
    assert visible("20 °C, 3 × 4 m, 月, é\\x1b") == "20 °C, 3 × 4 m, 月, é\\x1b"
    assert visible("a\x1b[2Jb\n\u202e") == "a\\x1b[2Jb\\n\\u202e"
    assert visible_lines("a\n\tb\r\x9b") == "a\n\tb\\r\\x9b"
    every = "".join(map(chr, range(sys.maxunicode + 1)))
    assert visible(every).isprintable()
    assert visible("".join(c for c in every if c.isprintable())) == "".join(c for c in every if c.isprintable())
    assert visible(every).encode()  # no lone surrogate is left


def test_the_name_and_text_of_an_event_come_with_control_characters_visible():
    mavlink = dialect.MAVLink(None)
    message = dialect.MAVLink_event_message(1_000_000, 1, 4, b"A\x1b[2J", "\x1b]0;x\x07\nforged \x9b".encode())
    (event,) = TelemetryReceiver().receive(bytes(message.pack(mavlink)), 0)
    assert event.name == "A\\x1b[2J" and event.text == "\\x1b]0;x\\x07\\nforged \\x9b"


def test_the_text_of_a_report_comes_with_control_characters_visible():
    heard = decode_report(encode_report(Report(1, 2, 3, RequestState.FAILED, 0, "no\x1b[2J\nway")))
    assert heard.text == "no\\x1b[2J\\nway"


@pytest.mark.parametrize("name", ["../x", "/tmp/x", "a/b", "..", ".x", "a\x1bb", "a\nb", "", "é", "[/red]", "a b"])
def test_a_product_whose_name_is_no_word_is_refused(name):
    raw = name.encode()
    body = bulk_wire.ANNOUNCE.pack(10, 5, bytes(32), len(raw), 4) + raw + b"json"
    with pytest.raises(WireError, match="chunk"):
        bulk_wire.announced(body)
    body = bulk_wire.ANNOUNCE.pack(10, 5, bytes(32), 3, len(raw)) + b"way" + raw
    if name:
        with pytest.raises(WireError, match="chunk"):
            bulk_wire.announced(body)


WAY = {"station": 1, "request_id": 3, "kind": "goal", "rule": "R4", "reason": "why", "length_m": 7.27, "time_s": 171.0,
       "looks": 3, "path": [[0.0, 0.0, 0.0], [6.0, 1.5, 0.1]], "beyond": [[8.0, 2.0]]}  # fmt: skip
BROKEN = [
    b"", b"{}", b"[]", b"null", b"\xff", b"[" * 100_000, b'{"a":' * 50_000, b'"way"', b"1e999",
    *(json.dumps({k: v for k, v in WAY.items() if k != key}).encode() for key in list(WAY)[2:]),
    *(json.dumps({**WAY, key: bad}).encode() for key, bad in [
        ("length_m", "7"), ("length_m", math.nan), ("length_m", True), ("time_s", None), ("time_s", [1]),
        ("looks", 1.5), ("looks", -1), ("looks", "3"), ("path", None), ("path", [[0.0, 0.0]]), ("path", [1, 2, 3]),
        ("path", [[0, 0, "x"]]), ("path", [[0, 0, math.inf]]), ("path", "abc"), ("beyond", {}), ("reason", 5),
        ("kind", None), ("rule", []), ("station", "1"), ("request_id", None),
        ("looks", 10**400), ("length_m", 10**400),
    ]),
]  # fmt: skip


@pytest.mark.parametrize("data", BROKEN, ids=range(len(BROKEN)))
def test_a_way_that_is_none_is_told_and_ends_no_program(data):
    heard = ProductHeard(5_000_000_000, Product(9, "way", "json", data))
    assert "cannot be read" in news_line(heard) and clean(news_line(heard))
    tree = json.loads(news_json(heard))
    assert tree["news"] == "product" and tree["at_ns"] == 5_000_000_000
    with pytest.raises(WireError, match="product"):
        way_words(data)


def test_a_way_takes_over_no_word_of_the_news():
    tree = json.loads(
        news_json(
            ProductHeard(7, Product(9, "way", "json", json.dumps({**WAY, "at_ns": 0, "news": "x", "more": 1}).encode()))
        )
    )
    assert (tree["news"], tree["at_ns"], "more" in tree) == ("way", 7, False)


def test_the_words_of_a_way_come_with_control_characters_visible():
    data = json.dumps({**WAY, "length_m": None, "time_s": None, "reason": HOSTILE}).encode()
    assert way_words(data).isprintable()
    assert news_line(ProductHeard(0, Product(9, "way", "json", data))).isprintable()


def test_what_the_verbs_write_has_control_characters_visible(capsys):
    for write in (line_out, text_out, line_beside, last_words, keys._say, lambda text: terminal._print([text])):
        write(HOSTILE)
        got = capsys.readouterr()
        assert "owned" in got.out + got.err and clean(got.out + got.err)
    line_out(HOSTILE)
    assert capsys.readouterr().out.count("\n") == 1  # no line is forged


def test_no_file_of_the_station_writes_to_a_terminal_but_the_one_that_makes_texts_visible():
    own = {"ground/cli/verbs/screen.py", "ground/cli/verbs/options.py"}  # the second asks its own question
    found = {
        str(path.relative_to(ROOT))
        for path in (ROOT / "ground").rglob("*.py")
        if re.search(r"std(out|err)\.write|(?<![\w.])print\(", path.read_text())
    }
    assert found <= own


def test_a_bar_takes_a_name_as_it_is(capsys):
    bars = Bars(lambda line: None, 1.0)
    bars.news([Progress(0, "[/red]", 1, 2)])
    bars.close()


def test_an_archive_of_another_program_shows_its_texts_visible(tmp_path, capsys):
    with Archive(tmp_path / "a.db", 1_000_000_000_000_000_000) as archive:
        archive.add("events", 0, 0, 1, "warning", "X\x1b[2J", HOSTILE.encode("utf-8", "replace").decode(), 1)
    for words in (["events"], ["events", "--json"]):
        assert run([*words, "--archive", str(tmp_path / "a.db")]) == 0
        text = capsys.readouterr().out
        assert "owned" in text and clean(text)


def test_a_report_shows_control_characters_and_html_as_text():
    html = page(HOSTILE, paragraph(HOSTILE + "<script>"), ()) + facts([(HOSTILE, "<b>")]) + table(("h",), [[HOSTILE]])
    assert clean(html) and "<script>" not in html and "<b>" not in html
    assert html.encode()


def test_the_strings_of_a_scanner_come_with_control_characters_visible():
    line = b"PROD:UTM\x1b[2J\x9b30LX"
    got = scip.parse_text(scip.Reply(b"VV", "00", line + b";" + scip.checksum(line)))
    assert got["PROD"] == "UTM\\x1b[2J\ufffd30LX"
    assert np.all([text.isprintable() for text in got.values()])
