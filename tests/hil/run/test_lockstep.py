"""The barrier calls its participants in turn, and says by name who was lost."""

import socket
import threading
from types import SimpleNamespace

import pytest

from hil.run.bench import Bench
from hil.run.lockstep import Barrier, ParticipantLostError
from protocol.barrier import Channel, Done, Hello, Receiver, Stop, Tick, encode


def participant(address, name, answers):
    """A participant in a thread that answers each tick by `answers(tick)`; what it received is returned by join."""
    _, host, port = address.split(":")
    heard = []

    def live():
        with socket.create_connection((host, int(port))) as line:
            line.sendall(encode(Hello(name)))
            receiver = Receiver()
            while data := line.recv(65536):
                for message in receiver.receive(data):
                    heard.append(message)
                    answer = answers(message) if isinstance(message, Tick) else None
                    if answer is not None:
                        line.sendall(encode(answer))
                    if isinstance(message, Stop) or (isinstance(message, Tick) and answer is None):
                        return

    thread = threading.Thread(target=live)
    thread.start()
    return thread, heard


def quiet():
    pass


def test_a_tick_carries_counts_out_and_back():
    barrier = Barrier()
    thread, heard = participant(
        barrier.address, "onboard", lambda t: Done(t.number, 9, {"can": 3 * t.number}, ("lidar",))
    )
    barrier.gather({"onboard"}, quiet)
    rover = barrier.participants["onboard"]
    channel = Channel("can", 11, stamps_us=(5, 6))
    rover.begin(4, 40_000_000, (channel,))
    done = rover.finish(quiet)
    assert (done.sent, done.connect, rover.wake_tick) == ({"can": 12}, ("lidar",), 9)
    barrier.close("enough")
    thread.join()
    assert heard[1] == Tick(4, 40_000_000, (channel,))
    assert heard[2] == Stop("enough")


def test_a_participant_that_leaves_in_a_tick_is_named():
    barrier = Barrier()
    thread, _ = participant(barrier.address, "ground", lambda t: None)
    barrier.gather({"ground"}, quiet)
    barrier.participants["ground"].begin(7, 0, ())
    with pytest.raises(ParticipantLostError, match=r"ground: .* tick 7"):
        barrier.participants["ground"].finish(quiet)
    thread.join()
    barrier.close()


def test_waiting_for_participants_notices_that_a_process_died():
    barrier = Barrier()

    def dead():
        raise ParticipantLostError("onboard", "exit code 78")

    with pytest.raises(ParticipantLostError, match="onboard: exit code 78"):
        barrier.gather({"onboard"}, dead)
    barrier.close()


def test_the_links_counts_go_on_over_restarts_of_the_flight_program(monkeypatch):
    bench = Bench.__new__(Bench)
    bench.hub = SimpleNamespace(disconnect=lambda client: None, wait_client=lambda client, limit_s: client)
    bench.lidar_server = SimpleNamespace(disconnect=lambda: None)
    bench.lidar_open, bench.tick, bench._can_client, bench._onboard_epoch, bench._sent_before = False, 9, 0, 0, 0
    monkeypatch.setattr(bench, "_gather", lambda names: None, raising=False)
    monkeypatch.setattr(bench, "unheard", lambda: None, raising=False)
    bench._link_counts = {"down_in": 4000, "down_out": 3990}
    bench.regain("onboard")
    bench._link_counts |= {"down_in": 26, "down_out": 4015}
    bench.regain("onboard")
    bench._link_counts |= {"down_in": 5, "down_out": 4020}
    assert bench._down() == {"sent": 4031, "received": 4020}
