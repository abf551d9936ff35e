"""Click-to-goto in a real Chromium over slow links: preview, confirmation, and the whole chain to its completion."""

import pytest
from playwright.sync_api import expect

from tests.page.seat import FIGURES, WAIT_MS, Seat, Served, a_port, wait_for

LINKS = {"ets8-b": 0.3, "2.6": 2.6}  # profile of the bench, or delay one way in s -> delay one way, s
CHAIN = ("requested", "sent", "heard", "accepted", "completed")
STEPS = """e => [...e.querySelectorAll("li")].map(
  li => [li.firstChild.textContent, parseFloat(li.querySelector("small").textContent)])"""


@pytest.mark.parametrize("link", LINKS)
def test_click_to_goto_is_previewed_confirmed_and_completed(browser, tmp_path, link):
    served = Served(tmp_path, a_port(), link)
    seat = Seat(browser, served)
    page = seat.page
    try:
        wait_for(page, "STANDBY", ".big:not(.stale)")
        page.get_by_role("button", name="Fetch map").click()
        wait_for(page, "get ldem", ".commands article.good")
        page.wait_for_function("document.querySelector('.map-words').textContent.includes('received')")
        box = page.locator(".map canvas").bounding_box()
        page.mouse.click(box["x"] + box["width"] * 0.62, box["y"] + box["height"] * 0.3)
        wait_for(page, "predicted", ".told")
        assert page.locator(".commands article", has_text="goto").count() == 0  # a preview sends nothing
        page.get_by_role("button", name="Drive there").click()
        goto = page.locator(".commands article", has_text="goto").first
        expect(goto.locator("li.reached")).to_have_count(2, timeout=WAIT_MS)
        seat.shot(f"goto_{link}_on_its_way")
        expect(goto.locator("li.reached")).to_have_count(5, timeout=WAIT_MS)
        steps = goto.evaluate(STEPS)
        assert tuple(name for name, _ in steps) == CHAIN and "good" in goto.get_attribute("class")
        heard_s, completed_s = steps[2][1], steps[4][1]
        assert heard_s >= 2 * LINKS[link] - 0.05 and completed_s > heard_s  # nothing is said before the light allows it
        FIGURES[f"goto_heard_{link}_s"] = heard_s
        expect(page.locator(".link-panel .delay")).to_contain_text("earliest answer")
        seat.shot(f"goto_{link}")
        assert not seat.complaints
    finally:
        seat.context.close()
        served.kill()
