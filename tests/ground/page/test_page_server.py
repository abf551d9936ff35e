"""The server's loop: what runs in it ends nothing of it, and does not hold up STOP."""

import asyncio
import threading
from types import SimpleNamespace

from ground.page import server
from ground.page.panels.board import Board
from ground.page.view.snapshot import EMPTY


class Pages:
    """A site whose view fails in the first turn, and one browser; `pushed` is set by the first push."""

    def __init__(self):
        self.turns, self.pushed = 0, asyncio.Event()
        self.live, self.maps = SimpleNamespace(snapshot=EMPTY), SimpleNamespace(tree=dict)
        self.feed = SimpleNamespace(take=lambda tree: None)

    def view(self):
        self.turns += 1
        if self.turns == 1:
            raise ValueError("no view")
        return {}

    def push(self, maps, slow):
        self.pushed.set()


def test_a_view_that_fails_once_does_not_end_the_pushing_to_all_browsers(monkeypatch, caplog):
    monkeypatch.setattr(server, "_PUSH_S", 0.0)

    async def pushed():
        pages = Pages()
        pushing, waiting = (
            asyncio.create_task(one) for one in (server.push_all(pages, {"browser": pages}), pages.pushed.wait())
        )
        await asyncio.wait((pushing, waiting), return_when=asyncio.FIRST_COMPLETED)
        pushing.cancel()
        waiting.cancel()
        return pages.pushed.is_set()

    assert asyncio.run(pushed()) and "no view" in caplog.text


def test_acknowledging_writes_its_file_outside_of_the_loop_that_serves_stop():
    written = []
    board = Board.__new__(Board)
    board._operator = True
    board._events = SimpleNamespace(rows=[{"key": "1-2"}, {"key": "1-1"}])
    board._site = SimpleNamespace(
        acknowledged=SimpleNamespace(add=lambda keys: written.append((keys, threading.current_thread())))
    )
    asyncio.run(board._acknowledge())
    ((keys, thread),) = written
    assert keys == ["1-1", "1-2"] and thread is not threading.main_thread()
