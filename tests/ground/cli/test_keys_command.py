"""`ground keys`: makes and pairs keys, names them without showing them, and never overwrites."""

import re
import stat

import pytest

from ground.__main__ import run
from ground.cli.operations import operate
from ground.station.settings import StationSettings, station_keys
from protocol.link.keyring import EPOCHS, KEY_DOWN, KEY_UP
from tests.ground.virtual_station import VirtualClock
from transport.key_file import read_keys


def ended(capsys, *words: str) -> tuple[int, str, str]:
    code = run(list(words))
    return code, *capsys.readouterr()


@pytest.fixture
def made(tmp_path, capsys):
    code, out, err = ended(capsys, "keys", "init", str(tmp_path / "keys"), "--stations", "3")
    assert (code, err) == (0, "")
    return tmp_path / "keys", out


def secrets_of(folder) -> set[str]:
    return {
        word
        for path in folder.rglob("*key*")
        if path.is_file()
        for word in re.findall(r"[0-9a-f]{64}", path.read_text())
    }


def test_init_makes_files_that_only_their_owner_reads_and_shows_no_secret(made):
    folder, out = made
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert len(files) == 2 + 3 * 2 + 1
    assert {stat.S_IMODE(path.stat().st_mode) for path in files} == {0o600}
    assert {stat.S_IMODE(path.parent.stat().st_mode) for path in files} == {0o700}
    assert len(secrets_of(folder)) == 4 and not any(secret[:16] in out for secret in secrets_of(folder))


def test_a_station_gets_its_own_command_key_alone_and_the_rover_all(made):
    folder, _ = made
    assert read_keys(str(folder / "rover" / "command.keys"), KEY_UP).key_ids == (1, 2, 3)
    assert read_keys(str(folder / "station-2" / "command.key"), KEY_UP).key_ids == (2,)
    assert read_keys(str(folder / "viewer" / "downlink.key"), KEY_DOWN).epochs == tuple(range(EPOCHS))
    assert [path.name for path in (folder / "viewer").iterdir()] == ["downlink.key"]


def test_init_refuses_to_overwrite_and_changes_nothing(made, capsys):
    folder, _ = made
    before = {path: path.read_text() for path in folder.rglob("*") if path.is_file()}
    (folder / "rover" / "command.keys").unlink()
    code, _, err = ended(capsys, "keys", "init", str(folder))
    assert code == 78 and err.count("\n") == 1 and "is not overwritten" in err
    assert not (folder / "rover" / "command.keys").exists()
    assert all(path.read_text() == text for path, text in before.items() if path.exists())


def test_show_ids_gives_the_same_fingerprint_at_both_ends_and_no_secret(made, capsys):
    folder, _ = made
    code, out, _ = ended(
        capsys, "keys", "show-ids", str(folder / "rover" / "command.keys"), str(folder / "station-2" / "command.key")
    )
    prints = re.findall(r"station 2 +([0-9a-f]{10})", out)
    assert code == 0 and len(prints) == 2 and len(set(prints)) == 1
    assert not any(secret[:16] in out for secret in secrets_of(folder))


def test_show_ids_of_a_file_that_others_may_read_is_refused(made, capsys):
    path = made[0] / "rover" / "downlink.key"
    path.chmod(0o644)
    code, out, err = ended(capsys, "keys", "show-ids", str(path))
    assert (code, out) == (78, "") and "chmod 600" in err


def test_rotate_to_an_epoch_that_is_not_loaded_here_is_refused_before_anything_is_sent(made, tmp_path, capsys):
    folder, _ = made
    (tmp_path / "ground.toml").write_text(
        f"command_keys = '{folder}/station-1/command.key'\ndownlink_key = '{folder}/station-1/downlink.key'\n"
        "state = 'state'\n"
    )
    code, _, err = ended(capsys, "keys", "rotate", "9", "--station", str(tmp_path / "ground.toml"))
    assert code == 64 and "epoch 9 is not loaded here" in err and "loaded: 0 1 2 3" in err


class Unreached:
    """A station that is never asked for anything: the refusal comes before the link is opened."""

    def __init__(self, settings, _archive, _halts_utc_ns=None) -> None:
        from ground.link.session import Session

        self.session = Session(station_keys(settings), settings.station)
        self.without = []

    def __enter__(self):
        return self

    def __exit__(self, *_) -> None:
        pass


def test_a_viewer_which_has_no_command_key_cannot_command(made, tmp_path, monkeypatch, capsys):
    folder, _ = made
    (tmp_path / "ground.toml").write_text(f"downlink_key = '{folder}/viewer/downlink.key'\nstate = 'state'\n")
    monkeypatch.setattr(operate, "Station", Unreached)
    monkeypatch.setattr(operate, "WallClock", VirtualClock)
    for words in (["goto", "1", "2"], ["stop"], ["lease", "ask"]):
        code, _, err = ended(capsys, *words, "--station", str(tmp_path / "ground.toml"))
        assert (code, err) == (
            78,
            "ground: this station has no command key (command_keys): it may watch, not command\n",
        )


def test_a_viewers_session_seals_nothing_whatever_is_asked(made):
    from ground.link.session import Session

    folder, _ = made
    settings = StationSettings(downlink_key=str(folder / "viewer" / "downlink.key"), state="x")
    session = Session(station_keys(settings), 1)
    with pytest.raises(ValueError, match="may watch, not command"):
        session.request("stop", {}, 0)
    assert session.send(0) == [] and session.next_due_ns(0) is None
