"""What another program holds: a port is tried again by the service (69), a state folder has one owner."""

import os
import signal
import socket
import stat
from pathlib import Path

import pytest

from onboard.config import ConfigError
from onboard.drivers.link.port import LinkPort, LinkPortError
from onboard.drivers.storage.folder_lock import FolderLock, FolderTakenError
from protocol.link.datagrams import bench_keys
from tests.onboard.app.test_wall_clock import EX_CONFIG, EX_UNAVAILABLE, alone, started

KEYS = bench_keys(7)
UNIT = Path(__file__).parents[3] / "tools" / "installation" / "service" / "el-dorado.service"


def restarts_after(code: int) -> bool:
    """Whether the unit starts the program again after this exit code."""
    rows = dict(line.split("=", 1) for line in UNIT.read_text().splitlines() if "=" in line and line[0] != "#")
    for_ever = rows["Restart"] == "on-failure" and rows["StartLimitIntervalSec"] == "0"
    return for_ever and str(code) not in rows["RestartPreventExitStatus"].split()


@pytest.fixture
def taken():
    """An endpoint that another program listens on."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        yield f"udp/127.0.0.1:{other.getsockname()[1]}"


def test_a_link_port_that_another_program_has_is_no_matter_of_the_configuration(taken):
    with pytest.raises(LinkPortError, match=r"link\.endpoint = 'udp/127.*in use") as told:
        LinkPort(taken, KEYS, 1)
    assert "/root" not in str(told.value) and "\n" not in str(told.value)


def test_an_address_that_this_machine_does_not_have_yet_is_waited_for_too():
    with pytest.raises(LinkPortError, match="assign requested address"):
        LinkPort("udp/192.0.2.1:7450", KEYS, 1)


@pytest.mark.parametrize("endpoint", [
    "nonsense", "tcp/", "udp/", "udp/nonsense", "udp/127.0.0.1", "udp/127.0.0.1:99999", "udp/127.0.0.1:abc",
    "foo/127.0.0.1:1",
])  # fmt: skip
def test_an_endpoint_that_no_wait_can_mend_is_a_matter_of_the_configuration(endpoint):
    with pytest.raises(ConfigError, match=r"link\.endpoint"):
        LinkPort(endpoint, KEYS, 1)


@pytest.mark.parametrize("number", [socket.EAI_AGAIN, socket.EAI_NONAME])
def test_a_host_name_that_nobody_resolves_now_is_waited_for_too(monkeypatch, number):
    def unresolved(*_, **__):
        raise socket.gaierror(number, "no answer")

    monkeypatch.setattr(socket, "getaddrinfo", unresolved)
    with pytest.raises(LinkPortError, match=r"link\.endpoint = 'udp/rover\.example:7450'.*rover\.example: no answer"):
        LinkPort("udp/rover.example:7450", KEYS, 1)


def test_the_service_tries_for_ever_where_the_link_port_is_taken(tmp_path, taken):
    settings = alone(tmp_path / "onboard.mcap") | {"link__endpoint": taken}
    with started("run", **settings) as program:
        out, told = program.communicate(timeout=60)
    assert (program.returncode, out) == (EX_UNAVAILABLE, "")
    assert "link.endpoint" in told and "in use" in told and told.count("\n") == 1
    assert restarts_after(EX_UNAVAILABLE) and not restarts_after(EX_CONFIG)


# -- the state folder ----------------------------------------------------------------------------------------------


def test_a_second_flight_program_on_a_state_folder_is_refused_and_takes_no_number_of_a_start(tmp_path):
    folder = tmp_path / "state"
    settings = alone(tmp_path / "one.mcap") | {"state__folder": folder}
    with started("run", **settings) as first:
        assert first.stderr.readline().startswith("onboard: running: wall clock")
        number = (folder / "boots.json").read_text()
        with started("run", **alone(tmp_path / "two.mcap") | {"state__folder": folder}) as second:
            out, told = second.communicate(timeout=60)
        assert (second.returncode, out) == (EX_UNAVAILABLE, "")
        assert told.count("\n") == 1 and str(folder) in told and f"process {first.pid}" in told
        assert (folder / "boots.json").read_text() == number and not (tmp_path / "two.mcap").exists()
        first.send_signal(signal.SIGKILL)
        first.wait(60)
    with started("run", **settings) as third:  # what was killed holds nothing
        assert third.stderr.readline().startswith("onboard: running: wall clock")
        assert (folder / "boots.json").read_text() != number
        third.send_signal(signal.SIGTERM)
        assert third.wait(60) == 0


def test_a_lock_is_given_back_and_a_stale_number_of_a_process_in_it_means_nothing(tmp_path):
    (tmp_path / "lock").write_text("1")
    with FolderLock(str(tmp_path)):
        assert (tmp_path / "lock").read_text() == str(os.getpid())
        with pytest.raises(FolderTakenError, match=f"process {os.getpid()}"):
            FolderLock(str(tmp_path))
    with FolderLock(str(tmp_path)):
        pass


def test_nobody_but_its_owner_can_take_the_lock(tmp_path):
    """flock works through a descriptor for reading: who may read the file could keep the rover from starting."""
    before = os.umask(0o022)
    try:
        with FolderLock(str(tmp_path / "new")):
            assert mode(tmp_path / "new") == 0o700 and mode(tmp_path / "new" / "lock") == 0o600
        (tmp_path / "lock").write_text("1")
        assert mode(tmp_path / "lock") == 0o644  # as earlier versions made it
        with FolderLock(str(tmp_path)):
            assert mode(tmp_path / "lock") == 0o600
    finally:
        os.umask(before)


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_without_a_folder_nothing_is_locked():
    with FolderLock(""), FolderLock(""):
        pass


def test_a_folder_that_cannot_be_written_is_flown_without_a_lock_and_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    with FolderLock(str(tmp_path / "file" / "state")) as lock:
        assert "is not locked" in lock.trouble
