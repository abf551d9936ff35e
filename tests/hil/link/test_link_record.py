"""`hil link` from outside: options, profiles, the file with each datagram's fate, live figures, the UDP relay."""

import csv
import json
import socket
from dataclasses import replace

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from hil.link import command
from hil.link.impairment import CAUSES, Impairment, Profile, both_directions, load_profile
from hil.link.record import Meter, Recorder
from hil.link.udp_relay import UdpRelay

S = 1_000_000_000
MS = 1_000_000
app = typer.Typer()
app.command()(command.main)


def run(*words: str):
    return CliRunner().invoke(app, words)


def recorded(path, seed):
    link = replace(load_profile("moon-bad"), blackout_first_s=2.0, queue_s=1.0, duplicate=0.1)
    models = both_directions(link, seed)
    with Recorder(path) as recorder:
        for k in range(2000):
            model = models[k % 2]
            for _ in range(1 + k % 5):
                data = bytes([1 + k % 5]) * (30 + k % 100)
                recorder.note(("down", "up")[k % 2], data, k * 5 * MS, model.offer(data, k * 5 * MS), model.arrivals_ns)
    return models


def test_the_record_has_each_datagram_with_its_fate_and_repeats_with_its_seed(tmp_path):
    models = recorded(tmp_path / "a.csv", 3)
    recorded(tmp_path / "b.csv", 3)
    recorded(tmp_path / "c.csv", 4)
    text = (tmp_path / "a.csv").read_text()
    assert text == (tmp_path / "b.csv").read_text() != (tmp_path / "c.csv").read_text()
    rows = list(csv.DictReader(text.splitlines()))
    for direction, model in zip(("down", "up"), models):
        mine = [row for row in rows if row["direction"] == direction]
        assert [int(row["number"]) for row in mine] == list(range(1, model.counts.offered + 1))
        for cause in CAUSES:
            assert sum(row["fate"] == cause for row in mine) == getattr(model.counts, cause)
        arrived = [row["arrives_s"].split() for row in mine]
        assert sum(len(times) == 2 for times in arrived) == model.counts.duplicated > 0
        assert all(bool(row["fate"]) != bool(row["arrives_s"]) for row in mine)
    assert {row["kind"] for row in rows} == {"MAVLINK", "BULK_CHUNK", "BULK_BITMAP", "TELECOMMAND", "REPORT"}
    assert models[1].counts.queue_full and models[0].counts.blackout


def test_the_figures_of_a_second_are_its_bytes_with_udp_and_ip():
    model = Impairment(Profile(one_way_s=0.5), 64e3, np.random.default_rng(1))
    meter = Meter("down", model)
    for k in range(10):
        model.offer(bytes(72), k * 100 * MS)
    model.due(S - 1)
    now = meter.now(S)
    assert (now.offered_bps, now.delivered_bps, now.under_way) == (10 * 800, 5 * 800, 5)
    assert meter.now(2 * S).offered_bps == 0
    assert now.text() == "down 8.0 kbit/s in, 4.0 out of 64, 0 of 10 lost, 5 on the way"


def test_a_blackout_and_the_causes_of_losses_are_shown():
    model = Impairment(Profile(blackout_length_s=9.0), 64e3, np.random.default_rng(1))
    model.offer(b"x", 0)
    text = Meter("up", model).now(S).text()
    assert "BLACKOUT" in text and "1 of 1 lost (1 blackout)" in text


def test_every_profile_is_listed_for_people_and_for_programs():
    told = run("--list")
    rows = json.loads(run("--list", "--json").stdout)
    assert [row["name"] for row in rows] == [
        "lan",
        "ets8-a",
        "ets8-b",
        "ets8-c",
        "ets8-shadow",
        "moon",
        "moon-bad",
        "stress",
    ]
    assert all(row["name"] in told.stdout for row in rows)
    table = {row["name"]: (row["down_bps"], row["up_bps"], row["one_way_s"], row["loss"]) for row in rows}
    assert table["moon-bad"] == (64e3, 16e3, 1.35, 0.3) and table["stress"] == (16e3, 16e3, 2.6, 0.3)
    assert table["lan"] == (100e6, 100e6, 0.001, 0.0) and table["ets8-c"] == (1024e3, 1024e3, 0.3, 0.1)


@pytest.mark.parametrize(("words", "code", "said"), [
    (["--profile", "moonbad"], 64, "did you mean `moon-bad`"),
    (["--profiles", "/nowhere.toml"], 64, "no such file of link profiles"),
    (["--carrier", "tcp"], 64, "--carrier 'tcp' should be zenoh or udp"),
    (["--carrier", "udp", "--barrier", "tcp:127.0.0.1:1"], 64, "leave it out"),
    (["--carrier", "udp", "--ground", "tcp/127.0.0.1:1"], 64, "--ground 'tcp/127.0.0.1:1' should be udp/HOST:PORT"),
    (["--barrier", "nonsense"], 64, "--barrier"),
    (["--record", "/nowhere/lost.csv"], 73, "/nowhere/lost.csv: No such file or directory"),
])  # fmt: skip
def test_a_mistake_is_one_clear_line(words, code, said):
    result = run(*words)
    assert result.exit_code == code
    assert said in result.stderr and result.stderr.count("\n") == 1
    assert result.stderr.startswith("hil link: ")


def test_a_port_in_use_is_named():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        endpoint = f"udp/127.0.0.1:{taken.getsockname()[1]}"
        result = run("--carrier", "udp", "--ground", endpoint)
    assert result.exit_code == 69
    assert f"cannot listen on {endpoint}" in result.stderr


def test_counts_and_record_are_written_at_the_end(tmp_path):
    words = ["--carrier", "udp", "--ground", "udp/127.0.0.1:0", "--seconds", "0.01"]
    assert run(*words, "--report", str(tmp_path / "r.json"), "--record", str(tmp_path / "r.csv")).exit_code == 0
    assert json.loads((tmp_path / "r.json").read_text())["up"]["offered"] == 0
    assert (tmp_path / "r.csv").read_text().startswith("time_s,direction,")


def test_the_relay_passes_both_ways_delayed_and_answers_whom_it_heard_last():
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rover,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground,
    ):
        rover.bind(("127.0.0.1", 0))
        for end in (rover, ground):
            end.settimeout(20.0)
        with UdpRelay(Profile(one_way_s=5.0), 1, rover.getsockname(), ("127.0.0.1", 0), None) as relay:
            ground.sendto(b"up", ("127.0.0.1", relay.port))
            while not relay.up.under_way:
                relay.turn(0)
            relay.turn(4 * S)
            assert relay.up.under_way
            relay.turn(6 * S)
            data, back = rover.recvfrom(100)
            assert data == b"up"
            rover.sendto(b"down", ("127.0.0.1", back[1]))
            while not relay.down.under_way:
                relay.turn(7 * S)
            relay.turn(13 * S)
            assert ground.recvfrom(100) == (b"down", ("127.0.0.1", relay.port))
            assert relay.report()["down"]["delivered"] == 1


def test_the_relay_listens_on_the_loopback_alone_and_takes_nothing_of_a_stranger_for_the_rovers():
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as rover,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ground,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        rover.bind(("127.0.0.1", 0))
        rover.settimeout(20.0)
        with UdpRelay(Profile(), 1, rover.getsockname(), ("127.0.0.1", 0), None) as relay:
            ground.sendto(b"up", ("127.0.0.1", relay.port))
            while not relay.up.under_way:
                relay.turn(0)
            relay.turn(S)
            back = rover.recvfrom(100)[1]
            mine = [relay._to_ground, *relay._to_rover.values()]
            assert len(mine) == 2 and {each.getsockname()[0] for each in mine} == {"127.0.0.1"}
            stranger.sendto(b"forged", ("127.0.0.1", back[1]))
            rover.sendto(b"down", ("127.0.0.1", back[1]))
            while not relay.down.counts.offered:
                relay.turn(2 * S)
            relay.turn(2 * S)
            assert relay.down.counts.offered == 1
