"""Server, browser and a person's seat for the checks of the page. Screenshots and figures go to build/page."""

import json
import os
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from playwright.sync_api import expect

ROOT = Path(__file__).parents[2]
OUT = ROOT / "build/page"
WAIT_MS = 90_000  # a busy computer shares its cores with this
WEBGL = (
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)  # without a GPU; all drawing is slow
FIGURES: dict[str, float] = {}


def find_chromium() -> Path | None:
    """The Chromium that $CHROMIUM names, else Debian's, else the one that Playwright has installed."""
    for name in (os.environ.get("CHROMIUM", ""), "chromium", "chromium-browser", "google-chrome"):
        if name and (found := shutil.which(name)):
            return Path(found)
    stored = Path(os.environ.get("PLAYWRIGHT_BROWSERS_PATH") or Path.home() / ".cache/ms-playwright")
    return max(stored.glob("chromium-*/chrome-linux*/chrome"), default=None)


def launched(play, *flags: str):
    """A Chromium started with these flags."""
    found = find_chromium()
    if found is None:
        pytest.fail("no Chromium: apt-get install chromium, or name one with CHROMIUM=/path")
    return play.chromium.launch(executable_path=found, args=["--no-sandbox", *flags])


class Served:
    """The server's process."""

    def __init__(self, folder: Path, port: int, link: str = "0.6", *states: str) -> None:
        self.folder, self.port, self.link = folder, port, link
        self.address = f"http://127.0.0.1:{port}"
        self.start(*states)

    def start(self, *states: str) -> None:
        words = [sys.executable, str(ROOT / "tests/page/toy_page.py"), str(self.folder), str(self.port)]
        words += [self.link, *states]
        self._log = open(OUT / "server.log", "a")  # noqa: SIM115 - it lives as long as the process
        self.process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, text=True
        )
        assert self.process.stdout.readline() == "ready\n", (OUT / "server.log").read_text()[-2000:]

    def order(self, line: str) -> None:
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline() == f"done {line}\n"

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def token(self, role: str) -> str:
        return json.loads((self.folder / "page-tokens.json").read_text())[role]


def a_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Seat:
    """One person at the page, with what the browser complained of and where it went."""

    def __init__(self, browser, served, role="operator", script="") -> None:
        self.context = browser.new_context(viewport={"width": 1440, "height": 1000})
        self.page, self.served = self.context.new_page(), served
        self.page.set_default_timeout(WAIT_MS)
        if script:
            self.page.add_init_script(script)
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda m: self.complaints.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda one: self.requests.append(one.url))
        self.page.goto(f"{served.address}/sign-in#{served.token(role)}")
        self.page.wait_for_url(f"{served.address}/")
        self.page.wait_for_selector(".headline .big")

    def shot(self, name: str) -> None:
        self.page.screenshot(path=OUT / f"{name}.png", full_page=True)


def wait_for(page, text, selector):
    expect(page.locator(selector).filter(has_text=text).first).to_be_visible(timeout=WAIT_MS)
