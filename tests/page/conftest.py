"""Fixtures of the checks of the page: one server and one browser for all, a seat for each check."""

import json

import pytest
from playwright.sync_api import sync_playwright

from tests.page.seat import FIGURES, OUT, Seat, Served, a_port, launched


@pytest.fixture(scope="session")
def served(tmp_path_factory):
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "server.log").write_text("")
    made = Served(tmp_path_factory.mktemp("station"), a_port())
    yield made
    made.process.terminate()
    assert made.process.wait(timeout=120) is not None
    (OUT / "figures.json").write_text(json.dumps(FIGURES, indent=1))


@pytest.fixture(scope="session")
def play():
    with sync_playwright() as made:
        yield made


@pytest.fixture(scope="session")
def browser(play):
    made = launched(play)
    yield made
    made.close()


@pytest.fixture
def operator(browser, served):
    seat = Seat(browser, served)
    yield seat
    seat.context.close()
