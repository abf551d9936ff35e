"""Past runs on the page in a real Chromium: the slider shows a run as it was, marked as past, and STOP stays live."""

from playwright.sync_api import expect

from tests.page.seat import wait_for


def choose(page, words):
    page.get_by_role("combobox", name="shown").click()
    page.get_by_role("option", name=words).first.click()


def test_a_past_run_is_marked_and_its_time_moves_and_stop_is_still_live(operator):
    page = operator.page
    wait_for(page, "STANDBY", ".big:not(.stale)")
    page.reload()
    page.wait_for_selector(".headline .big")
    choose(page, "run 1")
    wait_for(page, "PAST RUN", ".big.link.bad")
    expect(page.locator(".past-words")).to_contain_text("PAST, NOT LIVE")
    before = page.locator(".past-words").inner_text()
    page.get_by_role("button", name="−10 s").click()
    expect(page.locator(".past-words")).not_to_have_text(before)
    operator.shot("past")
    page.get_by_role("button", name="Scan").click()
    wait_for(page, "go back to live", ".told")
    page.keyboard.press("Escape")
    expect(page.locator("#stop-words.good")).to_contain_text("heard by the rover")
    page.get_by_role("button", name="Back to live").click()
    wait_for(page, "link up", ".big.link.good")
    assert not operator.complaints
