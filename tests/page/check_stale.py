"""Nothing old looks fresh, in a real Chromium: rover silent, station restarted, link one way only, clocks wrong."""

import os
import signal

import pytest
from playwright.sync_api import expect

from tests.page.seat import WAIT_MS, Seat, Served, a_port, wait_for

MINUTES_MS = 240_000
DAY_MS = 86_400_000


def all_is_stale(page):
    """Wait until no value looks fresh: headline, telemetry, wheels, slip, link."""
    page.wait_for_function("""() => {
      const none = (selector) => document.querySelectorAll(selector).length === 0;
      return none(".headline .big:not(.stale):not(.link)") && none(".values tbody tr:not(.stale)")
        && none(".wheels tbody tr:not(.stale)") && none(".wheels .slip:not(.stale)") && none(".big.link.good");
    }""")


@pytest.fixture
def own(tmp_path, browser):
    """Makes a server of its own and a seat at it; ends both."""
    made = []

    def make(*states, script=""):
        served = Served(tmp_path, a_port(), "0.6", *states)
        made.append(served)
        return served, Seat(browser, served, script=script)

    yield make
    for served in made:
        served.kill()


def test_rover_silent_for_minutes_all_is_old_and_says_for_how_long(operator, served):
    served.order("silent on")
    try:
        page = operator.page
        expect(page.locator(".big.link.bad")).to_contain_text("SILENT", timeout=WAIT_MS)
        all_is_stale(page)
        expect(page.locator(".big.stale", has_text="mode")).to_contain_text("2 min", timeout=MINUTES_MS)
        expect(page.locator(".link-panel dl")).to_contain_text("2 min ago")
        all_is_stale(page)
        operator.shot("silent")
    finally:
        served.order("silent off")
    wait_for(operator.page, "STANDBY", ".big:not(.stale)")


def test_values_grow_old_in_the_browser_when_the_server_freezes(operator, served):
    os.kill(served.process.pid, signal.SIGSTOP)
    try:
        expect(operator.page.locator(".big.link.bad")).to_contain_text("SERVER SILENT", timeout=WAIT_MS)
        wait_for(operator.page, "mode", ".big.stale")
    finally:
        os.kill(served.process.pid, signal.SIGCONT)
    wait_for(operator.page, "STANDBY", ".big:not(.stale)")


def test_station_restarted_values_of_the_archive_are_old_until_the_rover_is_received(own):
    served, seat = own()
    wait_for(seat.page, "STANDBY", ".big:not(.stale)")
    served.kill()
    expect(seat.page.locator(".big.link.bad")).to_contain_text("SERVER SILENT", timeout=WAIT_MS)
    served.start("silent")
    seat.page.goto(served.address)
    expect(seat.page.locator(".big.stale", has_text="mode")).to_contain_text("STANDBY", timeout=WAIT_MS)
    all_is_stale(seat.page)
    seat.shot("restarted_silent")
    served.order("silent off")
    wait_for(seat.page, "STANDBY", ".big:not(.stale)")


def test_over_a_link_that_carries_down_only_a_command_is_sent_and_not_heard_and_values_stay_fresh(operator, served):
    served.order("deaf on")
    try:
        page = operator.page
        page.get_by_role("button", name="Scan").click()
        article = page.locator(".commands article", has_text="scan").first
        expect(article.locator("li.reached")).to_have_count(2, timeout=WAIT_MS)
        assert article.locator("li.open").all_inner_texts() == ["heard", "accepted", "completed"]
        wait_for(page, "STANDBY", ".big:not(.stale)")  # telemetry still comes
    finally:
        served.order("deaf off")
    expect(article.locator("li.reached")).to_have_count(5, timeout=WAIT_MS)


def test_over_a_link_that_carries_up_only_a_command_is_sent_and_not_heard_and_values_grow_old(operator, served):
    page = operator.page
    wait_for(page, "STANDBY", ".big:not(.stale)")
    served.order("silent on")
    try:
        page.get_by_role("button", name="Scan").click()
        article = page.locator(".commands article", has_text="scan").first
        expect(article.locator("li.reached")).to_have_count(2, timeout=WAIT_MS)
        all_is_stale(page)
        assert article.locator("li.open").all_inner_texts() == ["heard", "accepted", "completed"]
    finally:
        served.order("silent off")
    expect(article.locator("li.reached")).to_have_count(5, timeout=WAIT_MS)


@pytest.mark.parametrize("clock", ["rate 0.5", "rate 2", "jump 3600", "jump -20"])
def test_rovers_clock_wrong_nothing_old_looks_fresh(own, clock):
    served, seat = own()
    wait_for(seat.page, "STANDBY", ".big:not(.stale)")
    seat.page.wait_for_function("parseFloat(document.querySelector('[data-item=x_m]').textContent) > 25")  # m: 25 s on
    served.order(f"clock {clock}")
    served.order("event LATER by that clock")
    wait_for(seat.page, "LATER", ".events td")
    if clock.startswith("rate"):
        expect(seat.page.locator(".pace")).to_contain_text("ages count from the arrival", timeout=WAIT_MS)
        wait_for(seat.page, "STANDBY", ".big:not(.stale)")
    served.order("silent on")
    all_is_stale(seat.page)


@pytest.mark.parametrize("off_ms", [-DAY_MS, DAY_MS], ids=["a day back", "a day ahead"])
def test_browsers_clock_wrong_changes_no_age(own, off_ms):
    served, seat = own(script=f"{{ const real = Date.now; Date.now = () => real() + ({off_ms}); }}")
    wait_for(seat.page, "STANDBY", ".big:not(.stale)")
    seat.page.get_by_role("button", name="Fetch map").click()
    expect(seat.page.locator(".map-words span:not(.stale)", has_text="received")).to_contain_text(
        "s ago", timeout=WAIT_MS
    )
    served.order("silent on")
    all_is_stale(seat.page)
