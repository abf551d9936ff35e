"""Who is let in: each attack by its name, on the rover's own gate and core, and that the genuine sender is not hurt."""

import json
import os
import stat
import threading

import numpy as np
import pytest

from onboard.config import Config, ConfigError, Link, load
from onboard.core.downlink import Downlink
from onboard.core.telemetry import TelemetryInputs
from onboard.drivers.link.port import Gate, link_keys
from onboard.drivers.link.saved_state import HOLD_NS, MARKS, LinkMemory
from onboard.records import LinkMessage
from protocol import WireError
from protocol.link import datagrams as link
from protocol.link.datagrams import DOWNLINK_KEY_ID, KEY_DOWN, KEY_UP, DatagramKind, Opener, Sealer
from protocol.link.keyring import EPOCHS, Keyring, LinkKeys, bench_keys
from protocol.tables import commands
from protocol.tables.modes import Mode
from transport.key_file import KeyFileError, read_keys

BENCH = bench_keys(11)
EPOCHAL = tuple(range(EPOCHS))
SECRETS = {1: bytes(range(32)), 2: bytes(range(32, 64))}
KEYS = LinkKeys(Keyring(KEY_UP, SECRETS, EPOCHAL), Keyring(KEY_DOWN, {0: bytes(range(64, 96))}, EPOCHAL))
S = 1_000_000_000


class Ground:
    """A station's sealer, which outlives the rover's boots as its counters do on disk."""

    def __init__(self, station: int = 1, boot_id: int = 5, epoch: int = 0):
        self.sealer = Sealer(KEYS.command.key(station, epoch), station, boot_id, epoch=epoch)
        self._next_id = 1

    def payload(self, name: str, **arguments) -> bytes:
        self._next_id += 1
        return commands.encode(commands.Telecommand(self._next_id, 0, 0, name, arguments))

    def goto(self) -> bytes:
        return self.sealer.seal(DatagramKind.TELECOMMAND, self.payload("goto", x_m=1.0, y_m=2.0))

    def stop(self) -> bytes:
        return self.sealer.seal_halt(self.payload("stop"))


class Rover:
    """Gate and core end as the flight program has them; `restart` is a new boot over the same disk."""

    def __init__(self, folder, boot_id: int = 5, wait: bool = True):
        self._folder, self._wait = str(folder), wait
        self.start(boot_id)

    def start(self, boot_id: int) -> None:
        self.memory = LinkMemory(self._folder, KEYS, self._wait)
        halted = json.dumps(self.memory.halted).encode()
        self.gate, self.core = Gate(KEYS, boot_id, self.memory), Downlink(Link(), halted)
        self.core.sample(TelemetryInputs(mode=Mode.STANDBY), 0)
        self.boot_id = boot_id

    def restart(self) -> None:
        self.memory.close()
        self.start(self.boot_id + 1)

    def hears(self, datagram: bytes, now_ns: int = S) -> LinkMessage:
        (message,) = self.gate.receive(datagram, now_ns)
        return message

    def does(self, datagram: bytes, now_ns: int = S) -> list[str]:
        return [order.name for order in self.core.receive(self.gate.receive(datagram, now_ns), now_ns)]

    def refuses(self, datagram: bytes) -> str:
        message = self.hears(datagram)
        assert not message.accepted and message.payload == b""
        return message.verdict


@pytest.fixture
def rover(tmp_path):
    return Rover(tmp_path / "state")


# -- what is not let in ------------------------------------------------------------------------------------------


def test_forged_any_changed_byte_is_refused_and_the_genuine_datagram_still_opens(rover):
    genuine = Ground().goto()
    for n in range(len(genuine)):
        forged = bytearray(genuine)
        forged[n] ^= 1
        assert rover.refuses(bytes(forged)) == "tag"
    assert rover.does(genuine) == ["goto"]


def test_forged_with_the_key_of_another_seed_or_station_is_refused(rover):
    payload = Ground().payload("goto", x_m=1.0, y_m=1.0)
    stranger = Sealer(BENCH.command.key(1), 1, 5)
    as_other = Sealer(KEYS.command.key(2), 1, 5)
    assert [rover.refuses(s.seal(4, payload)) for s in (stranger, as_other)] == ["tag", "tag"]


def test_replayed_is_refused_and_not_done_again(rover):
    goto = Ground().goto()
    assert rover.does(goto) == ["goto"]
    assert [rover.refuses(goto) for _ in range(5)] == ["copy"] * 3 + ["replay"] * 2


def test_what_a_network_doubles_is_counted_and_alarms_nobody_but_a_replay_does(rover):
    ground = Ground()
    heard = [ground.goto() for _ in range(300)]
    for datagram in heard:
        assert rover.does(datagram) == ["goto"] and rover.does(datagram) == []
    assert rover.core.refused == {"copy": 300} and rover.core.refused_count == 0
    assert rover.core.notices == []
    assert rover.does(heard[0]) == []
    assert [notice.text for notice in rover.core.notices] == ["replay 1"]


def test_replayed_after_a_restart_of_the_rover_is_refused_and_the_genuine_key_gets_through_at_once(rover):
    ground = Ground()
    heard = [ground.goto() for _ in range(20)]
    assert [rover.does(d) for d in heard] == [["goto"]] * 20
    rover.restart()
    assert {rover.refuses(d) for d in heard} == {"boot"}
    ground.sealer.boot_id = rover.boot_id
    assert rover.does(ground.goto()) == ["goto"]


def test_replayed_after_a_restart_of_the_ground_is_refused_there_and_the_rover_is_heard_at_once():
    down = Sealer(KEYS.downlink.key(DOWNLINK_KEY_ID), DOWNLINK_KEY_ID, 5)
    heard = [down.seal(DatagramKind.MAVLINK, b"old") for _ in range(20)]
    before = Opener(KEYS.downlink)
    assert all(before.open(d).payload == b"old" for d in heard)
    again = Opener(KEYS.downlink, newest_boot_id=before.boot_id)
    again.heard_before(DOWNLINK_KEY_ID, before.highest(DOWNLINK_KEY_ID))
    for datagram in heard:
        with pytest.raises(WireError) as refused:
            again.open(datagram)
        assert refused.value.kind == "replay"
    assert again.open(down.seal(DatagramKind.MAVLINK, b"new")).payload == b"new"


def test_future_counter_is_refused_and_the_senders_own_go_on(rover):
    ground, future = Ground(), Ground()
    assert rover.does(ground.goto()) == ["goto"]
    future.sealer.counter = ground.sealer.counter + 2**20 + 1
    assert rover.refuses(future.goto()) == "jump"
    assert rover.does(ground.goto()) == ["goto"]


def test_old_epoch_is_refused_once_a_later_one_is_in_force_also_after_a_restart(rover):
    old, new = Ground(epoch=0), Ground(epoch=1)
    assert rover.refuses(new.goto()) == "epoch"  # loaded, and not in force yet
    assert rover.does(old.goto()) == ["goto"]
    assert rover.memory.switch(1).result().error == ""
    rover.gate.use(1)
    assert rover.refuses(old.goto()) == "epoch"
    new.sealer.counter = old.sealer.counter
    assert rover.does(new.goto()) == ["goto"]
    rover.restart()
    old.sealer.boot_id = rover.boot_id
    assert rover.refuses(old.goto()) == "epoch"


def test_an_epoch_that_is_not_loaded_is_never_put_in_force(rover):
    assert "epoch 9 is not loaded in both of the rover's key files; loaded: 0 1 2 3" in rover.memory.switch(9).result()
    assert rover.memory.epoch == 0


def test_wrong_boot_older_and_newer_is_refused(rover):
    assert [rover.refuses(Ground(boot_id=n).goto()) for n in (0, 4, 6, 2**32 - 1)] == ["boot"] * 4


def test_wrong_direction_is_refused_even_with_one_secret_for_both(rover):
    own = Sealer(KEYS.downlink.key(0), 0, 5)
    assert rover.refuses(own.seal(DatagramKind.TELECOMMAND, Ground().payload("stop"))) == "tag"
    reflected = Sealer(Keyring(KEY_DOWN, SECRETS).key(1), 1, 5)
    assert rover.refuses(reflected.seal(DatagramKind.TELECOMMAND, Ground().payload("stop"))) == "tag"
    with pytest.raises(WireError, match="tag"):
        Opener(KEYS.downlink).open(Ground().goto())


def test_truncated_is_refused_at_every_length(rover):
    genuine = Ground().goto()
    assert {rover.refuses(genuine[:n]) for n in range(len(genuine))} == {"length", "tag"}


def test_oversized_is_refused_with_and_without_a_right_tag(rover):
    genuine = Ground().goto()
    assert rover.refuses(genuine + bytes(1151 - len(genuine))) == "length"
    assert rover.refuses(genuine + b"\0") == "tag"


def test_1e5_garbage_frames_are_refused_and_told_while_every_genuine_command_passes(rover):
    rng, ground = np.random.default_rng(3), Ground()
    genuine, done, garbage, now_ns = ground.goto(), [], 0, 0
    shapes = [genuine, genuine[:40], bytes(1150), ground.goto()]
    while garbage < 100_000:
        now_ns += S // 10
        for n in range(1000):
            noise = bytearray(shapes[n % 4])
            noise[-16:] = rng.bytes(16)
            rover.core.receive(rover.gate.receive(bytes(noise), now_ns), now_ns)
        garbage += 1000
        done += rover.does(ground.goto(), now_ns)
    assert done == ["goto"] * 100
    assert rover.core.refused == {"tag": 100_000}
    told = [notice.text for notice in rover.core.notices if notice.name == "LINK_REFUSED"]
    assert len(told) == 1  # in 10 s
    assert rover.core.heard_ns == {1: now_ns}


# -- stop and safe, whatever the boot ----------------------------------------------------------------------------


def test_stop_sent_while_the_rover_reboots_stops_it_once(rover):
    ground = Ground(boot_id=5)
    stop = ground.stop()  # sealed for boot 5, and under way
    rover.restart()
    assert rover.does(stop) == ["stop"]
    assert rover.refuses(stop) == "copy"


@pytest.mark.parametrize("boot_id", [0, 5, 99])
@pytest.mark.parametrize("name", ["stop", "safe", "emergency_stop"])
def test_what_halts_counts_with_any_boot_id(rover, name, boot_id):
    ground = Ground(boot_id=boot_id)
    assert rover.does(ground.sealer.seal_halt(ground.payload(name))) == [name]


def test_replayed_stop_after_a_restart_is_refused_for_its_mark_was_written_before_it_was_done(rover, tmp_path):
    stop = Ground().stop()
    message = rover.hears(stop)
    assert message.accepted and message.verdict == "ok"
    assert list(json.loads((tmp_path / "state" / MARKS).read_bytes()).values()) == [0, 2]  # counter and request id
    rover.restart()
    assert rover.refuses(stop) == "replay"


def test_a_stop_in_an_older_loaded_epoch_counts(rover):
    assert rover.memory.switch(2).result().error == ""
    rover.gate.use(2)
    assert rover.does(Ground(epoch=1).stop()) == ["stop"]


def test_the_exception_is_for_halting_commands_at_once_and_for_nothing_else(rover):
    ground = Ground(boot_id=99)
    later = commands.encode(commands.Telecommand(7, 0, 0, "stop", {}, start_ns=S))
    for payload in (ground.payload("goto", x_m=1.0, y_m=1.0), ground.payload("resume"), later, b"", b"\2" * 29):
        with pytest.raises(ValueError, match="halts"):
            ground.sealer.seal_halt(payload)
        genuine_key_wrong_use = ground.sealer._sealed(DatagramKind.TELECOMMAND, link.HALT, 50, payload)
        assert rover.refuses(genuine_key_wrong_use) == "kind"
    assert rover.does(ground.stop()) == ["stop"]


def test_the_two_counters_do_not_touch_each_other(rover):
    ground = Ground()
    for _ in range(3):
        assert rover.does(ground.goto()) == ["goto"]
        assert rover.does(ground.stop()) == ["stop"]
    assert rover.memory.marks == {} and ground.sealer.counter == 3


def test_a_stop_does_not_wait_for_an_ill_disk_and_says_so(tmp_path):
    (tmp_path / "state").write_text("a file where the folder should be")
    rover = Rover.__new__(Rover)
    rover._folder, rover._wait = str(tmp_path / "state" / "none"), True
    rover.start(5)
    message = rover.hears(Ground().stop())
    assert (message.accepted, message.verdict) == (True, "unkept")
    rover.core.receive([message], S)
    assert [n.text for n in rover.core.notices] == [
        "the mark of a command of station 1 is not kept: others could send it again after a restart"
    ]


def test_a_stop_waits_for_its_mark_and_for_a_slow_disk_only_so_long(tmp_path):
    rover = Rover(tmp_path / "state", wait=False)
    disk = threading.Event()
    rover.memory._pool.submit(disk.wait)
    try:
        assert rover.gate.receive(Ground().stop(), S) == []
        assert rover.gate.release(S + HOLD_NS - 1) == []
        (message,) = rover.gate.release(S + HOLD_NS)
        assert (message.accepted, message.verdict) == (True, "unkept")
    finally:
        disk.set()


def test_marks_belong_to_a_key_so_a_new_key_begins_anew(tmp_path):
    rover = Rover(tmp_path / "state")
    assert rover.does(Ground().stop()) == ["stop"]
    others = LinkKeys(Keyring(KEY_UP, {1: b"n" * 32}, EPOCHAL), KEYS.downlink)
    assert LinkMemory(str(tmp_path / "state"), others).marks == {}
    assert LinkMemory(str(tmp_path / "state"), KEYS).marks == {1: 0}


@pytest.mark.parametrize("text", ["[", "[1]", '{"1 x": "many"}'])
def test_damaged_marks_stop_the_start_with_one_line(tmp_path, text):
    (tmp_path / MARKS).write_text(text)
    with pytest.raises(ConfigError, match=f"{MARKS}: cannot be read .*make new keys"):
        LinkMemory(str(tmp_path), KEYS)


# -- keys --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660, 0o644, 0o777])
def test_key_file_modes_that_others_may_read_are_refused(tmp_path, mode):
    path = tmp_path / "k"
    path.write_text(link.format_keys(KEY_UP, SECRETS))
    path.chmod(mode)
    with pytest.raises(KeyFileError, match=rf"mode {mode:04o}.*chmod 600"):
        read_keys(str(path), KEY_UP)


def test_key_files_need_a_state_folder_or_an_old_start_could_be_replayed(tmp_path):
    for name, direction, secrets in (("up", KEY_UP, SECRETS), ("down", KEY_DOWN, {0: b"d" * 32})):
        (tmp_path / name).write_text(link.format_keys(direction, secrets))
        (tmp_path / name).chmod(0o600)
    files = {"link.command_keys": str(tmp_path / "up"), "link.downlink_key": str(tmp_path / "down")}
    with pytest.raises(ConfigError, match=r"state\.folder: with key files"):
        link_keys(load(overrides=files))
    assert link_keys(load(overrides=files | {"state.folder": str(tmp_path)})).command.key_ids == (1, 2)


def test_no_secret_in_what_keys_say_of_themselves():
    shown = repr(KEYS) + str(KEYS.command) + "".join(KEYS.command.fingerprint(n) for n in SECRETS)
    for secret in (*SECRETS.values(), *(KEYS.command.key(n, e) for n in SECRETS for e in EPOCHAL)):
        assert secret.hex()[:8] not in shown
    assert repr(Config()).count("key") > 0  # it names files, and holds nothing of them


def test_fingerprints_tell_keys_apart_and_not_directions_or_epochs_alone():
    again = Keyring(KEY_UP, SECRETS, (0,))
    assert again.fingerprint(1) == KEYS.command.fingerprint(1) != KEYS.command.fingerprint(2)
    assert Keyring(KEY_DOWN, SECRETS).fingerprint(1) != again.fingerprint(1)


def test_the_ground_follows_to_a_later_loaded_epoch_and_never_back():
    ground, key = Opener(KEYS.downlink), KEYS.downlink.key
    frames = [Sealer(key(0, e), 0, 5, counter=n, epoch=e).seal(1, b"") for n, e in enumerate((0, 2, 0, 1, 3))]
    verdicts = []
    for frame in frames:
        try:
            ground.open(frame)
            verdicts.append(ground.epoch)
        except WireError as error:
            verdicts.append(error.kind)
    assert verdicts == [0, 2, "epoch", "epoch", 3]
    with pytest.raises(WireError, match="epoch"):
        ground.open(Sealer(key(0, 7), 0, 5, counter=9, epoch=7).seal(1, b""))


def test_state_files_that_are_written_are_whole_and_hold_no_secret(rover, tmp_path):
    assert rover.does(Ground().stop()) == ["stop"]
    assert rover.memory.switch(1).result().error == ""
    files = {path.name: path for path in (tmp_path / "state").iterdir()}
    assert set(files) == {MARKS, "epoch.json"}
    text = b"".join(path.read_bytes() for path in files.values())
    assert not any(secret.hex().encode() in text or secret in text for secret in SECRETS.values())
    assert all(stat.S_ISREG(os.stat(path).st_mode) for path in files.values())


def test_a_halt_jumps_by_two_to_the_20_at_most_and_the_first_of_a_key_may_be_any(rover):
    ground = Ground()
    counters = iter([700, 700 + 2**20 + 1, 700 + 2**20, 700 + 2**20 - 1, 701 + 2**20])
    ground.sealer.next_halt = lambda: next(counters)
    assert [rover.hears(ground.stop()).verdict for _ in range(5)] == ["ok", "jump", "ok", "replay", "ok"]


def test_halts_of_one_sender_count_from_zero_and_of_two_stations_apart(rover, tmp_path):
    one, two = Ground(1), Ground(2)
    opened = [Opener(KEYS.command, boot_id=5).open(one.stop()).counter for _ in range(2)]
    assert opened == [0, 1]
    assert rover.does(two.stop()) == ["stop"] and rover.does(one.stop()) == ["stop"]
    marks = json.loads((tmp_path / "state" / MARKS).read_bytes())
    counters = {name: mark for name, mark in marks.items() if not name.endswith(" asked")}
    assert sorted((name.split()[0], mark) for name, mark in counters.items()) == [("1", 2), ("2", 0)]


def test_the_flag_means_nothing_on_the_way_down():
    down = Sealer(KEYS.downlink.key(DOWNLINK_KEY_ID), DOWNLINK_KEY_ID, 5)
    with pytest.raises(WireError, match="kind"):
        Opener(KEYS.downlink).open(down.seal_halt(Ground().payload("stop")))


def test_a_stop_in_an_epoch_that_is_not_loaded_is_refused(rover):
    assert rover.refuses(Ground(epoch=200).stop()) == "epoch"


def test_the_highest_counter_heard_is_told_and_nothing_before_the_first():
    down, ground = Sealer(KEYS.downlink.key(DOWNLINK_KEY_ID), DOWNLINK_KEY_ID, 5, counter=40), Opener(KEYS.downlink)
    assert ground.highest(DOWNLINK_KEY_ID) == -1
    ground.open(down.seal(1, b""))
    assert ground.highest(DOWNLINK_KEY_ID) == 40


@pytest.mark.parametrize("epochs", [(1, 0), (2, 2), ()])
def test_epochs_of_a_keyring_rise(epochs):
    with pytest.raises(ValueError, match="rising epochs"):
        Keyring(KEY_UP, SECRETS, epochs)
