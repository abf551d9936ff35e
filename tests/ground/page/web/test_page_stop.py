"""STOP over plain HTTP, without the page's library: its own page, the form, the answers, and who may press it."""

import pytest
from fastapi.testclient import TestClient

from ground.page.live.acknowledged import Acknowledged
from ground.page.live.link import Live
from ground.page.map.maps import Maps
from ground.page.web.access import Role, Tokens, cookie_name, cookie_value, hosts_of
from ground.page.web.guard import Gate, Guard
from ground.page.web.site import Site, routes
from ground.station.settings import StationSettings

PORT, TOKENS = 8765, Tokens("o" * 32, "v" * 32)
JSON = {"accept": "application/json"}


@pytest.fixture
def live():
    return Live(StationSettings(bench_seed=7), lambda *_: None)  # not started: its link is closed


@pytest.fixture
def browser(live, tmp_path):
    def made(role):
        gate = Gate(TOKENS, hosts_of("127.0.0.1", PORT), PORT)
        site = Site(gate, live, Maps(None, None), Acknowledged(tmp_path / "seen.json"), "")
        cookies = {cookie_name(PORT): cookie_value(TOKENS, role)}
        return TestClient(Guard(routes(site), gate), base_url=f"http://127.0.0.1:{PORT}", cookies=cookies)

    return made


def waiting(live):
    return [order.name for order in live._inbox]


def test_the_page_of_stop_alone_has_the_form_and_no_script_but_its_own(browser):
    page = browser(Role.OPERATOR).get("/stop")
    assert page.status_code == 200 and '<form method="post" action="/stop">' in page.text
    assert page.text.count("<script") == 1 and 'src="/static/stop.js"' in page.text
    assert 'id="stop-button" type="submit" ' in page.text


def test_the_form_asks_for_a_stop_while_the_link_is_closed_and_its_button_says_how_far_it_is(browser, live):
    seat = browser(Role.OPERATOR)
    answer = seat.post("/stop")
    assert waiting(live) == ["stop"] and "waits for the link" in answer.text
    press = answer.text.split('name="press" value="')[1].split('"')[0]
    assert "waits for the link" in seat.post("/stop", data={"press": press}).text
    assert waiting(live) == ["stop"]  # the same press


def test_a_press_that_is_posted_again_asks_once_and_a_new_one_again(browser, live):
    seat = browser(Role.OPERATOR)
    for press in ("press-one", "press-one", "press-two"):
        assert seat.post("/stop", data={"press": press}, headers=JSON).json()["state"] == "waiting"
    assert waiting(live) == ["stop", "stop"]


def test_a_stop_goes_before_all_that_waits(browser, live):
    live.ask("safe", {}, "test")
    browser(Role.OPERATOR).post("/stop")
    assert waiting(live)[0] == "stop"


def test_a_viewer_cannot_stop_and_his_button_is_off(browser, live):
    seat = browser(Role.VIEWER)
    assert seat.post("/stop").status_code == 403 and waiting(live) == []
    assert "disabled" in seat.get("/stop").text.split("stop-button")[1].split(">")[0]


def test_a_damaged_press_is_refused(browser, live):
    answer = browser(Role.OPERATOR).post("/stop", data={"press": "<x>"}, headers=JSON)
    assert answer.status_code == 400 and waiting(live) == []
