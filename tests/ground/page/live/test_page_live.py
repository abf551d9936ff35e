"""The page's link over closed and opened carriers: what becomes of orders, above all of a stop."""

import asyncio
import struct
from concurrent.futures import Future

import pytest

from ground.archive.store import ArchiveError
from ground.link.news import ProductHeard
from ground.page.live import link as page_live
from ground.page.live.link import Live
from ground.page.panels.board import handed_over
from ground.page.view.model import view
from ground.station.settings import StationSettings
from ground.station.station import Station, StationError
from onboard.config import ConfigError
from protocol.link.bulk import Product
from tests.ground.virtual_station import VirtualStation

GOTO = {"x_m": 1.0, "y_m": 2.0}


class Carrier(VirtualStation):
    """A station on a carrier that closes in a turn. steps: turn -> what happens in it; deaf: nothing goes up."""

    def __init__(self, closes, steps=None, deaf=False, **rover):
        super().__init__(**rover)
        self._closes, self._steps, self._turn = closes, steps or {}, 0
        if deaf:
            self.rover.receive = lambda *_: None

    def turn(self, turn):
        self._turn += 1
        if self._turn == self._closes:
            raise StationError("the carrier has closed")
        news = super().turn(turn)
        self._steps.get(self._turn, lambda: None)()
        return news


def fly(live, monkeypatch, *carriers):
    """Run the link's loop in the test's own thread: each carrier once; a callable in between is called."""
    monkeypatch.setattr(page_live, "_RETRY_S", 0.0)
    left = list(carriers)

    def opened(settings, archive, *more):
        while left and not isinstance(left[0], Carrier):
            left.pop(0)()
        if not left:
            live._end.set()
            raise StationError("the test ends")
        return left.pop(0)

    live._open_station = opened
    live._run()


def asked(station):
    """Names of the requests of a station, in their order."""
    return [one.telecommand.name for one in station.session.requester.requests.values()]


def a_live(**more):
    return Live(StationSettings(bench_seed=7, **more), lambda *_: None)


def test_a_stop_that_a_browser_no_longer_waits_for_is_sent_when_the_link_opens(monkeypatch):
    live, station = a_live(), Carrier(9)
    assert live.ask("stop", {}, "test").cancel()
    fly(live, monkeypatch, station)
    assert asked(station) == ["stop"] and station.rover.executed == ["stop"]


def test_a_withdrawn_order_is_not_sent_and_the_next_stop_is():
    live, station = a_live(), Carrier(0)
    live._inbox.append(page_live.Order("goto", GOTO, 60.0, "test"))
    live._inbox[0].taken.cancel()
    stop = live.ask("stop", {}, "test")
    live._take_orders(station.session, 0)
    assert asked(station) == ["stop"]
    assert stop.result(timeout=0) in station.session.requester.requests


def test_the_board_leaves_a_waiting_stop_with_the_link_and_withdraws_any_other_order():
    stop, goto = Future(), Future()
    assert "waits" in asyncio.run(handed_over(stop, "stop", 0.0))
    assert not stop.cancelled() and stop.set_running_or_notify_cancel()
    with pytest.raises(ValueError, match="not taken"):
        asyncio.run(handed_over(goto, "goto", 0.0))
    assert not goto.set_running_or_notify_cancel()  # the link's thread leaves it out


def test_an_order_that_the_link_takes_is_asked_for_and_a_refused_one_has_its_reason():
    taken, refused = Future(), Future()
    taken.set_result(7)
    refused.set_exception(ValueError("no key"))
    assert "asked for" in asyncio.run(handed_over(taken, "goto", 0.0))
    with pytest.raises(ValueError, match="no key"):
        asyncio.run(handed_over(refused, "goto", 0.0))


def test_an_order_to_move_that_meets_a_closing_link_is_refused_and_never_sent_after_it(monkeypatch):
    live = a_live()
    late = page_live.Order("goto", GOTO, 60.0, "test")
    second = Carrier(9)
    fly(live, monkeypatch, Carrier(3), lambda: live._inbox.append(late), second)
    assert "not sent" in str(late.taken.exception(timeout=0)) and not asked(second)


def test_a_link_that_closes_refuses_what_moves_the_rover_and_keeps_what_halts_it_in_order():
    live = a_live()
    orders = [page_live.Order(name, GOTO if name == "goto" else {}, 0.0, "test") for name in ("stop", "goto", "safe")]
    live._inbox.extend(orders)
    live._publish_down("nobody is there")
    assert "nobody is there" in str(orders[1].taken.exception(timeout=0))
    assert [order.name for order in live._inbox] == ["stop", "safe"] and not orders[0].taken.done()
    assert "stop, safe" in live.snapshot.trouble


def test_a_stop_sent_into_a_dead_link_is_sent_again_after_each_opening_and_its_press_follows_it(monkeypatch):
    live = a_live()
    taken, rows = live.ask("stop", {}, "page operator"), []
    lost = [Carrier(4, deaf=True), Carrier(4, {2: lambda: live.ask("safe", {}, "test")}, deaf=True)]
    heard = Carrier(40)
    heard._steps[3] = lambda: rows.append(live.command(taken.result()))
    fly(live, monkeypatch, lost[0], lost[1], heard)
    assert asked(lost[0]) == ["stop"] and asked(lost[1]) == ["stop", "safe"] and asked(heard) == ["stop", "safe"]
    assert heard.rover.executed == ["stop", "safe"]
    (renewed, _) = heard.session.requester.requests
    assert [row.request_id for row in rows] == [renewed]
    assert all(one.asked_by in ("page operator", "test") for one in heard.session.requester.requests.values())


def test_a_stop_with_its_final_report_is_not_sent_again(monkeypatch):
    live, first, second = a_live(), Carrier(40), Carrier(9)
    live.ask("stop", {}, "test")
    fly(live, monkeypatch, first, second)
    assert first.rover.executed == ["stop"] and not asked(second)


@pytest.mark.parametrize("error", [KeyError("x_m"), ValueError("no number"), struct.error("short")])
def test_an_error_that_nobody_foresaw_opens_the_link_again_with_its_stop_and_is_logged(monkeypatch, caplog, error):
    def fail(*_):
        raise error

    live, seen = a_live(), []
    live.ask("stop", {}, "test")
    first, second = Carrier(9, deaf=True), Carrier(9)
    first._steps[3] = lambda: setattr(live, "_hear", fail)
    fly(live, monkeypatch, first, lambda: (seen.append(live.snapshot), delattr(live, "_hear")), second)
    assert not seen[0].linked and type(error).__name__ in seen[0].trouble and "stop waits" in seen[0].trouble
    assert second.rover.executed == ["stop"] and "Traceback" in caplog.text


def test_a_product_that_cannot_be_shown_ends_nothing(monkeypatch, caplog):
    def fail(product, utc_ns):
        raise KeyError(product.name)

    live, station = Live(StationSettings(bench_seed=7), fail), Carrier(0)
    live._hear([ProductHeard(0, Product(1, "ldem", "ldem-2", b""))], station.session)
    assert "ldem" in live._says[-1] and "Traceback" in caplog.text


def test_a_thread_that_has_ended_takes_no_stop():
    live = a_live()
    live._end.set()
    live.start()
    live.stop()
    with pytest.raises(ValueError, match="ended"):
        live.ask("stop", {}, "test")


def test_requests_of_a_closed_link_stay_on_the_page_without_the_times_of_its_clock(monkeypatch):
    live, shots = a_live(), []
    taken = live.ask("stop", {}, "test")
    second = Carrier(9, {3: lambda: shots.append(live.snapshot)})
    fly(live, monkeypatch, Carrier(80), lambda: shots.append(live.snapshot), second)
    closed, opened = shots
    for shot in (closed, opened):
        (row,) = shot.commands
        assert (row.request_id, row.name) == (taken.result(), "stop")
        assert row.requested_ns is None and row.sent_ns is None and row.heard_ns is None
    assert not view(closed, closed.mono_ns)["link"]["on_its_way"] and opened.linked and not closed.linked


class Line:
    """A link's end without a rover; `ends` is called with the first datagram."""

    linked, sends_unasked = True, False

    def __init__(self, ends):
        self.sent, self._ends = [], ends

    def wait_open(self, *_):
        return True

    def take(self, most):
        return []

    def put(self, datagram):
        self.sent.append(datagram)
        self._ends()

    def close(self):
        pass


@pytest.mark.parametrize("broken", ["archive", "state"])
def test_a_stop_is_sent_without_a_file_of_the_station_that_cannot_be_used(tmp_path, broken):
    path = tmp_path / "broken"
    path.write_bytes(b"neither an archive nor a folder" * 100)
    live = a_live(**{broken: str(path)})
    line = Line(live._end.set)

    class OnLine(Station):
        def _opened(self, endpoint):
            return line

    live._open_station = OnLine
    with pytest.raises((ArchiveError, ConfigError, OSError)):
        live._session()
    goto = page_live.Order("goto", GOTO, 0.0, "test")
    stop = live.ask("stop", {}, "test")
    live._refuse_waiting = lambda why: live._inbox.append(goto)
    live._session()
    assert len(line.sent) == 1 and stop.done() and "broken" in goto.taken.exception(timeout=0).args[0]
    assert "broken" in live.snapshot.trouble and any("halts" in text for text in live._says)
