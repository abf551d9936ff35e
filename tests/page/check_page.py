"""The operator's page in a real Chromium: `make test-page`. The suite of all tests does not collect this file.

The rover is a toy on the wall clock behind a delay of 0.6 s each way. Times are measured and written to figures.json;
the limits here are wide, as they must hold on a busy computer.
"""

import time
import urllib.error
import urllib.request

import pytest
from playwright.sync_api import expect

from tests.page.seat import FIGURES, WAIT_MS, Seat, wait_for

HOSTILE = (
    "<img src=x onerror=window.owned=1><script>window.owned=2</script>{{constructor.constructor('window.owned=3')()}}"
)


def test_page_shows_the_rover_with_ages_and_asks_only_this_server(operator, served):
    began_s = time.monotonic()
    operator.page.goto(served.address)
    operator.page.wait_for_selector(".headline .big .text")
    FIGURES["first_headline_s"] = time.monotonic() - began_s
    paint = operator.page.evaluate("performance.getEntriesByType('paint').map(p => p.startTime)")
    FIGURES["first_paint_s"] = max(paint) / 1000
    wait_for(operator.page, "STANDBY", ".big:not(.stale)")
    wait_for(operator.page, "link up", ".big.link.good")
    operator.page.wait_for_timeout(1500)
    operator.shot("standby")
    assert not operator.complaints
    assert all(url.startswith((served.address, "data:", "blob:")) for url in operator.requests), operator.requests


def test_a_click_previews_by_the_rovers_planner_and_the_confirmed_goto_completes(operator):
    page = operator.page
    page.get_by_role("button", name="Fetch map").click()
    wait_for(page, "get ldem", ".commands article.good")
    page.wait_for_function("document.querySelector('.map-words').textContent.includes('received')")
    box = page.locator(".map canvas").bounding_box()
    page.mouse.click(box["x"] + box["width"] * 0.62, box["y"] + box["height"] * 0.3)
    wait_for(page, "predicted", ".told")
    operator.shot("preview")
    page.get_by_role("button", name="Drive there").click()
    wait_for(page, "goto", ".commands article:not(.final)")
    wait_for(page, "goto", ".commands article.good")
    chain = page.locator(".commands article", has_text="goto").first.locator("li.reached").all_inner_texts()
    names = ("requested", "sent", "heard", "accepted", "completed")
    assert len(chain) == 5 and all(found.startswith(name) for found, name in zip(chain, names))
    operator.shot("driven")


def test_goto_by_keyboard_alone(operator):
    page = operator.page
    page.locator(".map canvas").focus()
    page.keyboard.press("Enter")
    wait_for(page, "predicted", ".told")
    button = page.get_by_role("button", name="Drive there")
    for _ in range(40):
        page.keyboard.press("Tab")
        if button.evaluate("e => e === document.activeElement"):
            break
    page.keyboard.press("Enter")
    wait_for(page, "goto", ".commands article:not(.final)")
    wait_for(page, "goto", ".commands article.good")


@pytest.mark.parametrize("way", ["key", "button"])
def test_stop_is_heard_while_a_product_floods_the_link_and_says_when(operator, served, way):
    page = operator.page
    served.order("flood")
    page.get_by_label("x, east, m").fill("4")
    page.get_by_label("y, north, m").fill("2")
    page.get_by_role("button", name="Preview").click()
    page.get_by_role("button", name="Drive there").click()
    wait_for(page, "goto", ".commands article:not(.final)")
    page.get_by_label("any command").focus()
    began_s = time.monotonic()
    if way == "key":
        page.keyboard.press("Escape")
    else:
        page.locator("#stop-button").click()
    expect(page.locator("#stop-words.good")).to_contain_text("heard by the rover", timeout=WAIT_MS)
    FIGURES[f"stop_by_{way}_heard_s"] = time.monotonic() - began_s
    wait_for(page, "stop", ".commands article.good")
    wait_for(page, "stopped by the operator", ".commands article.failed")
    operator.shot(f"stop_by_{way}")


def test_stop_works_when_the_rest_of_the_page_is_broken(operator):
    operator.page.evaluate(
        "() => { window.socket.disconnect(); document.getElementById('app').remove();"
        " window.Vue = null; window.onkeydown = (e) => e.stopImmediatePropagation(); }"
    )
    operator.page.keyboard.press("Escape")
    expect(operator.page.locator("#stop-words.good")).to_contain_text("heard by the rover", timeout=WAIT_MS)


def test_stop_works_when_the_pages_library_and_its_websocket_never_come(operator, served):
    page = operator.page
    page.route("**/_nicegui*/**", lambda route: route.abort())
    for name in ("feed", "ages", "map", "headline", "wheels"):
        page.route(f"**/static/{name}.js", lambda route: route.abort())
    page.goto(served.address)
    assert page.locator(".headline").count() == 0
    page.keyboard.press("Escape")
    expect(page.locator("#stop-words.good")).to_contain_text("heard by the rover", timeout=WAIT_MS)


def test_stop_works_without_scripts(browser, served):
    cookies = Seat(browser, served)
    context = browser.new_context(java_script_enabled=False, storage_state=cookies.context.storage_state())
    cookies.context.close()
    page = context.new_page()
    page.goto(served.address)
    page.locator("#stop-button").click()
    for _ in range(60):
        if "heard by the rover" in page.content():
            break
        page.locator("main button").click()
    assert "heard by the rover" in page.content()
    context.close()


def test_no_script_of_a_rovers_text_runs(operator, served):
    served.order(f"event EVIL {HOSTILE[:90]}")
    served.order(f"event WORSE {HOSTILE[46:136]}")
    wait_for(operator.page, "EVIL", ".events td")
    wait_for(operator.page, "onerror", ".events td")
    assert operator.page.evaluate("window.owned") is None
    assert operator.page.locator(".events img, .events script").count() == 0


def test_an_injected_script_is_stopped_by_the_policy(operator):
    operator.page.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=window.owned=1>')")
    operator.page.wait_for_timeout(300)
    assert operator.page.evaluate("window.owned") is None


def test_a_viewer_sees_all_and_can_order_nothing(browser, served):
    seat = Seat(browser, served, "viewer")
    wait_for(seat.page, "STANDBY", ".big:not(.stale)")
    assert seat.page.locator("#stop-button").is_disabled() and seat.page.get_by_role("button", name="Scan").count() == 0
    status = seat.page.evaluate("fetch('/stop', {method: 'POST', body: 'press=press-viewer-1'}).then(r => r.status)")
    assert status == 403
    seat.page.locator(".map canvas").click()
    assert seat.page.locator(".told").count() == 0
    seat.shot("viewer")
    seat.context.close()


def test_foreign_sites_names_and_strangers_are_refused(served):
    def status(path="/", **headers):
        try:
            with urllib.request.urlopen(urllib.request.Request(served.address + path, headers=headers)) as answer:
                return answer.status
        except urllib.error.HTTPError as error:
            return error.code

    assert status("/state") == 401
    assert status("/sign-in", Host="evil.example:80") == 421
    assert status("/sign-in", Origin="http://evil.example") == 403


def test_a_foreign_websocket_is_refused(served, browser):
    context = browser.new_context()
    page = context.new_page()
    page.goto("data:text/html,<p>evil")
    opened = page.evaluate(
        "address => new Promise(done => { const s = new WebSocket(address); s.onopen = () => done('open');"
        " s.onerror = () => done('refused'); })",
        served.address.replace("http", "ws") + "/_nicegui_ws/socket.io/?EIO=4&transport=websocket",
    )
    assert opened == "refused"
    context.close()


def test_ten_viewers_at_once_and_an_update_reaches_all(browser, served):
    seats = [Seat(browser, served, "viewer") for _ in range(10)]
    began_s = time.monotonic()
    served.order(f"event TEN viewers {time.time_ns()}")
    for seat in seats:
        wait_for(seat.page, "TEN", ".events td")
    FIGURES["event_at_ten_viewers_s"] = time.monotonic() - began_s
    for seat in seats:
        seat.context.close()


def test_a_killed_server_comes_back_with_what_it_knew_and_the_page_with_it(operator, served):
    served.kill()
    expect(operator.page.locator(".big.link.bad")).to_contain_text("SERVER SILENT", timeout=WAIT_MS)
    operator.page.keyboard.press("Escape")
    expect(operator.page.locator("#stop-words.bad")).to_contain_text("SERVER DOES NOT ANSWER", timeout=WAIT_MS)
    operator.shot("server_killed")
    served.start()
    served.order("event MISSED while the server was dead")
    operator.page.wait_for_function("!document.querySelector('#stop-words.bad')", timeout=2 * WAIT_MS)
    wait_for(operator.page, "STANDBY", ".big:not(.stale)")
    wait_for(operator.page, "EVIL", ".events td")  # from the archive
    wait_for(operator.page, "MISSED", ".events td")  # from the rover, which sends it until it is received
    wait_for(operator.page, "an earlier session", ".commands article")
    operator.shot("restarted")
