"""`ground gateway` as the user meets it: what it opens, and the one line that it says where something is wrong."""

import socket

import pytest

from ground.__main__ import run
from ground.gateway.frames import cut, decode
from ground.gateway.frames import mavlink as m
from tests.ground.virtual_station import VirtualClock, VirtualStation


@pytest.fixture
def free():
    """Addresses on which nothing listens, and a socket that does."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        taken.setblocking(False)
        yield taken


@pytest.fixture
def meet(tmp_path, monkeypatch, capsys):
    """Runs the command against a virtual station: exit code, lines, last words."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ground.toml").write_text("bench_seed = 7\norigin_latitude_deg = 38.25\norigin_longitude_deg = 140.5\n")

    def meet(*argv: str, **station) -> tuple[int, str, str]:
        monkeypatch.setattr("ground.cli.operations.operate.Station", lambda *_: VirtualStation(**station))
        monkeypatch.setattr("ground.cli.operations.operate.WallClock", lambda: VirtualClock())
        code = run(["gateway", *argv])
        streams = capsys.readouterr()
        assert "Traceback" not in streams.err
        return code, streams.out, streams.err

    return meet


def test_it_shows_the_rover_at_the_station_s_origin_until_the_carrier_closes(meet, free):
    there = f"127.0.0.1:{free.getsockname()[1]}"
    code, out, err = meet("--port", "127.0.0.1:0", "--to", there, closed_s=3.0)
    assert code == 69
    assert err == "ground: the link's carrier has closed\n"
    assert "STANDBY" in out
    messages = []
    while True:
        try:
            messages += [decode(frame) for frame in cut(free.recv(2048))]
        except BlockingIOError:
            break
    assert {"HEARTBEAT", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"} <= {one.get_type() for one in messages}
    place = next(one for one in messages if one.get_type() == "GLOBAL_POSITION_INT")
    assert (place.lat / 1e7, place.lon / 1e7) == (pytest.approx(38.25, abs=1e-3), pytest.approx(140.5, abs=1e-3))
    assert next(one for one in messages if one.get_type() == "HEARTBEAT").type == m.MAV_TYPE_GROUND_ROVER


def test_no_rover_is_one_line(meet):
    code, _, err = meet("--port", "127.0.0.1:0", "--to", "none", "--contact", "2", silent=((0.0, 1e9),))
    assert (code, err.count("\n")) == (69, 1)
    assert "nothing heard of the rover within 2 s" in err


def test_a_taken_port_is_one_line(meet, free):
    there = f"127.0.0.1:{free.getsockname()[1]}"
    code, _, err = meet("--port", there, "--to", "none")
    assert (code, err.count("\n")) == (69, 1)
    assert f"UDP {there}: Address already in use; name another port" in err


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (("--port", "0.0.0.0:14551"), "unsigned MAVLink stays on this machine"),
        (("--to", "192.0.2.1:14550"), "unsigned MAVLink stays on this machine"),
        (("--port", "14551"), "should be like 127.0.0.1:14551"),
        (("--port", "127.0.0.1:99999"), "a port is a number up to 65535"),
        (("--origin", "38"), "should be LAT,LON or LAT,LON,HEIGHT"),
        (("--origin", "91,0"), "should be a latitude from -89.9 to 89.9"),
        (("--signed", "0.0.0.0:14552"), "a signed port needs a key"),
        (("--key", "k"), "a key a signed port"),
        (("--port", "none", "--to", "127.0.0.1:14550"), "told from the unsigned port, which is closed"),
    ],
)
def test_a_wrong_option_is_one_line_of_usage(meet, argv, said):
    code, out, err = meet(*argv)
    assert (code, out, err.count("\n")) == (64, "", 1)
    assert said in err


def test_a_signed_port_needs_a_folder_for_its_times_and_a_key_of_its_owner_s(meet, tmp_path):
    key = tmp_path / "signing.key"
    key.write_text("passphrase a b c\n")
    key.chmod(0o644)
    options = ("--port", "127.0.0.1:0", "--to", "none", "--signed", "127.0.0.1:0", "--key", str(key))
    code, _, err = meet(*options)
    assert (code, err.count("\n")) == (78, 1)
    assert "state: a signed port needs a folder" in err
    with (tmp_path / "ground.toml").open("a") as file:
        file.write("state = 'state'\n")
    code, _, err = meet(*options)
    assert (code, err) == (78, f"ground: {key}: mode 0644, others may read this key; chmod 600 it\n")
    key.chmod(0o600)
    for more in ((), ("--port", "none")):
        code, _, err = meet(*options, *more, closed_s=1.0)
        assert (code, "carrier has closed" in err) == (69, True)


def test_the_help_says_how_a_program_connects(meet):
    code, out, _ = meet("--help")
    assert code == 0
    assert "mavproxy.py --master=udpout:127.0.0.1:14551" in " ".join(out.split())
