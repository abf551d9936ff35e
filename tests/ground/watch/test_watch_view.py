"""The terminal view as a whole: by textual's pilot and under a pseudo-terminal, at 80 x 24 and 200 x 60."""

import asyncio
import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest
from textual.widgets import Input

from ground.cli.watch.app import WatchApp
from tests.ground.watch.test_watch_parts import live

ROOT = Path(__file__).parents[3]
SIZES = [(80, 24), (200, 60)]
_LIMIT_S = 300.0


def lines(app, size):
    """Lines of the screen."""
    strips = app.screen._compositor.render_strips()
    return ["".join(segment.text for segment in strips[row]) for row in range(size[1])]


async def typed(app, pilot, line):
    """A line in the command line, and Enter."""
    app.query_one(Input).value = line
    await pilot.press("enter")


def see(size, steps, **station):
    """Run the view on a virtual station; `steps` drives it. Returns the app and its session."""
    session, view = live(**station)
    app = WatchApp(session, view)

    async def drive():
        async with app.run_test(size=size) as pilot:

            async def until(true):
                while not true():
                    await pilot.pause()

            await steps(app, pilot, until)

    asyncio.run(asyncio.wait_for(drive(), _LIMIT_S))
    return app, session


@pytest.mark.parametrize("size", SIZES)
def test_map_state_link_events_and_keys_are_all_on_the_screen(size):
    shown = []

    async def steps(app, pilot, until):
        await until(lambda: app.live.session.heard_ns is not None)
        await pilot.press("ctrl+g")
        await until(lambda: app.view.terrain is not None)
        app.show()
        await pilot.pause()
        shown.extend(lines(app, size))

    app, _ = see(size, steps)
    text = "\n".join(shown)
    assert all(len(line) == size[0] for line in shown) and len(shown) == size[1]
    assert shown[0].startswith("link: received") and "STANDBY" in text and "^X STOP" in shown[-1]
    assert "map" in text and "free" in text and "product   ldem" in text
    assert sum(line.count("▀") for line in shown) > 0.3 * size[0] * size[1] * 0.4
    assert app.live._station.rover.executed == ["get"]


def test_older_events_are_reached_by_page_up_and_the_newest_again_by_page_down():
    async def steps(app, pilot, until):
        for number in range(100):
            app.view.add_line(f"line {number}.")
        for key, end in (("pageup", 100 - 1 - 3), ("pagedown", 100 - 1)):
            await pilot.press(key)
            app.show()
            await pilot.pause()
            drawn = [line for line in lines(app, (80, 24)) if line.startswith("line ")]
            assert drawn[-1].strip() == f"line {end}."
        for _ in range(100):
            await pilot.press("pageup")
        assert any(line.startswith("line 0.") for line in lines(app, (80, 24)))

    see((80, 24), steps, silent=((0.0, 1e9),))


@pytest.mark.parametrize("key", ["ctrl+x", "f12"])
def test_one_key_stops_the_rover_while_a_line_is_typed_and_the_view_says_when_it_was_confirmed(key):
    async def steps(app, pilot, until):
        await until(lambda: app.live.session.heard_ns is not None)
        await typed(app, pilot, "goto 12 3")
        await until(lambda: app.live._station.rover.executed == ["goto"])
        app.query_one(Input).value = "goto 5"
        await pilot.press(key)
        await until(lambda: app.live.shell.settled(app.live.session))
        app.show()
        await pilot.pause()
        assert any("STOP done, confirmed" in line for line in lines(app, (80, 24)))
        assert any("goto 5" in line for line in lines(app, (80, 24)))  # what was typed is still there

    app, session = see((80, 24), steps, drive_s=1000.0)
    assert app.live._station.rover.executed == ["goto", "stop"]
    assert [r.state.name for r in session.session.requester.requests.values()] == ["CANCELLED", "COMPLETED"]


def test_a_stop_is_asked_of_a_rover_that_was_never_heard():
    async def steps(app, pilot, until):
        await pilot.press("ctrl+x")
        await until(lambda: app.live._station.sent > 1)
        app.show()
        await pilot.pause()
        assert any("not confirmed yet" in line for line in lines(app, (80, 24)))

    see((80, 24), steps, silent=((0.0, 1e9),))


def test_a_mistake_is_a_line_in_the_view_and_quit_ends_it():
    async def steps(app, pilot, until):
        await typed(app, pilot, "goto x 3")
        await until(lambda: any("goto" in line.text and "ground:" in line.text for line in app.view.lines))
        await typed(app, pilot, "quit")
        await until(lambda: not app.is_running)

    app, _ = see((80, 24), steps)
    assert app.return_value == 0 and app.failure is None


def test_a_link_that_closes_ends_the_view_with_its_reason():
    async def steps(app, pilot, until):
        await until(lambda: not app.is_running)

    app, _ = see((80, 24), steps, closed_s=2.0)
    assert "the link's carrier has closed" in str(app.failure)


PROGRAM = """
import sys
sys.path[:0] = ["tests/ground"]
from tests.ground.watch.test_watch_parts import live
from ground.cli.watch.app import WatchApp
session, view = live(drive_s=1000.0)
code = WatchApp(session, view).run()
print("ended", code, session._station.rover.executed)
"""


class Terminal:
    """A program under a pseudo-terminal of a given size."""

    def __init__(self, size):
        self.heard = b""
        self._us, them = pty.openpty()
        fcntl.ioctl(them, termios.TIOCSWINSZ, struct.pack("HHHH", size[1], size[0], 0, 0))
        environment = {**os.environ, "TERM": "xterm-256color", "COLORTERM": "truecolor", "PYTHONPATH": str(ROOT)}
        self.run = subprocess.Popen([sys.executable, "-c", PROGRAM], cwd=ROOT, env=environment, stdin=them,
                                    stdout=them, stderr=them, start_new_session=True)  # fmt: skip
        os.close(them)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.run.kill()
        self.run.wait()
        os.close(self._us)

    def until(self, words):
        """Read until these bytes come; fails if the program ends before."""
        while words not in self.heard:
            try:
                data = os.read(self._us, 65_536)
            except OSError:
                data = b""
            assert data, f"ended without {words!r}: {self.heard[-2000:]!r}"
            self.heard += data

    def type(self, keys):
        os.write(self._us, keys)


@pytest.mark.parametrize("size", SIZES)
def test_under_a_pseudo_terminal_it_draws_takes_keys_and_leaves_the_terminal_as_it_was(size):
    with Terminal(size) as terminal:
        terminal.until(b"STANDBY")
        assert b"\x1b[?1049h" in terminal.heard and "▀".encode() in terminal.heard
        terminal.type(b"goto 12 3\r")
        terminal.until(b"AUTONOMOUS")
        terminal.type(b"\x18")  # Ctrl-X
        terminal.until(b"STOP done")
        terminal.type(b"\x03")  # Ctrl-C
        terminal.until(b"ended 130 ['goto', 'stop']")
        assert b"\x1b[?1049l" in terminal.heard
        assert terminal.run.wait() == 0
