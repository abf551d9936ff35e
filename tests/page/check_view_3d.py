"""3D panel in a real Chromium: cloud, terrain and rover are drawn; a new scan changes the picture; age; no WebGL."""

import io
import os
import signal

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect

from tests.page.seat import OUT, WAIT_MS, WEBGL, Seat, launched, wait_for

FRAMES = "Number(document.querySelector('.view-3d').dataset.frames)"
HIDE = "() => { Object.defineProperty(document, 'hidden', { value: %s, configurable: true });" + (
    " document.dispatchEvent(new Event('visibilitychange')); }"
)

READ = """async () => {
  const { cloud_of, terrain_of } = await import("/static/buffers.js");
  const plain = (found) => Object.fromEntries(Object.entries(found).map(([k, v]) => [k, v?.buffer ? [...v] : v]));
  const packed = (head, body) => {
    const made = new ArrayBuffer(8 * head.length + 4 * body.length);
    new Float64Array(made, 0, head.length).set(head); new Float32Array(made, 8 * head.length).set(body);
    return made;
  };
  return [cloud_of(packed([3, 9, 4, NaN], [0, 0, 0, 1, 0, 1, 2, 0, 2])),
    terrain_of(packed([0.5, 2.0, 0.1, 2, 3], [0, 0.1, 0.2, 0.3, 0.4, NaN]))].map(plain);
}"""


def picture(page):
    """(rows, columns, 3) of the canvas, as a person sees it."""
    return np.asarray(Image.open(io.BytesIO(page.locator(".view-3d canvas").screenshot())).convert("RGB"), int)


def fetch_scan(page, served, rise_m):
    """A new scan comes down; wait until the panel has drawn it."""
    before = page.locator(".view-3d").get_attribute("data-scan")
    served.order(f"scan {rise_m}")
    page.wait_for_function(
        "before => !['', before].includes(document.querySelector('.view-3d').dataset.scan)", arg=before
    )
    frames = page.evaluate(FRAMES)
    page.get_by_role("button", name="from above").click()
    page.wait_for_function(f"{FRAMES} > {frames}")


@pytest.fixture(scope="module")
def browser(play):
    """A browser of its own: with WebGL in software every page draws slowly."""
    made = launched(play, *WEBGL)
    yield made
    made.close()


@pytest.fixture
def panel(operator, served):
    """The page with map and scan drawn."""
    page = operator.page
    wait_for(page, "STANDBY", ".big:not(.stale)")
    page.get_by_role("button", name="Fetch map").click()
    wait_for(page, "get ldem", ".commands article.good")
    page.locator(".view-3d").scroll_into_view_if_needed()
    fetch_scan(page, served, 0.0)
    return operator


def test_cloud_terrain_and_rover_are_drawn_with_the_age_of_the_cloud(panel):
    page = panel.page
    expect(page.locator(".cloud-words:not(.stale)")).to_contain_text("measured", timeout=WAIT_MS)
    expect(page.locator(".terrain-words:not(.stale)")).to_contain_text("received", timeout=WAIT_MS)
    page.locator(".view-3d button").first.click()
    colours = np.unique(picture(page).reshape(-1, 3), axis=0)
    assert len(colours) > 200
    assert 0 < int(page.locator(".view-3d").get_attribute("data-points")) <= 20_000
    panel.shot("view_3d")
    page.get_by_role("button", name="behind the rover").click()
    page.wait_for_timeout(500)
    page.locator(".view-3d-card").screenshot(path=OUT / "view_3d_rover.png")
    assert not panel.complaints
    assert all(url.startswith((panel.served.address, "data:", "blob:")) for url in panel.requests), panel.requests


def test_a_new_scan_changes_the_picture(panel, served):
    before = picture(panel.page)
    fetch_scan(panel.page, served, 0.4)
    assert (np.abs(picture(panel.page) - before).max(axis=2) > 30).mean() > 0.01


def test_nothing_is_drawn_and_nothing_fetched_while_the_tab_is_hidden(panel, served):
    page = panel.page
    page.evaluate(HIDE % "true")
    frames, asked = page.evaluate(FRAMES), len([url for url in panel.requests if "cloud.bin" in url])
    served.order("scan 0.2")
    page.wait_for_function("document.querySelector('.link-panel').textContent.includes('scan')")
    page.wait_for_timeout(3_000)
    assert page.evaluate(FRAMES) == frames and len([url for url in panel.requests if "cloud.bin" in url]) == asked
    page.evaluate(HIDE % "false")
    page.wait_for_function(f"{FRAMES} > {frames}")


def test_an_old_cloud_is_grey_and_says_its_age(panel, served):
    page = panel.page
    expect(page.locator(".cloud-words:not(.stale)")).to_contain_text("measured", timeout=WAIT_MS)
    fresh = picture(page)
    os.kill(served.process.pid, signal.SIGSTOP)
    try:
        page.evaluate("() => { const real = Date.now; Date.now = () => real() + 3_600_000; }")  # an hour of silence
        expect(page.locator(".cloud-words.stale")).to_contain_text("60 min", timeout=WAIT_MS)
        frames = page.evaluate(FRAMES)
        page.get_by_role("button", name="from above").click()
        page.wait_for_function(f"{FRAMES} > {frames}")
        colour = [np.ptp(one, axis=2).mean() for one in (fresh, picture(page))]
        page.locator(".view-3d-card").screenshot(path=OUT / "view_3d_old.png")
    finally:
        os.kill(served.process.pid, signal.SIGCONT)
    assert colour[1] < colour[0]


def test_the_browser_reads_the_buffers_as_the_server_writes_them(operator):
    cloud, terrain = operator.page.evaluate(READ)
    assert cloud["points"] == 3 and cloud["whole"] == 9 and cloud["stop"] == 4 and cloud["taken_utc_s"] is None
    assert cloud["positions"] == [0, 0, 0, 1, 0, 1, 2, 0, 2]
    assert cloud["colours"][:3] == pytest.approx([0, 32 / 255, 77 / 255])  # the lowest
    assert cloud["colours"][6:] == pytest.approx([1, 234 / 255, 70 / 255])
    assert terrain["positions"][3:6] == pytest.approx([0.6, 2.0, 0.1])
    assert terrain["triangles"] == [0, 1, 4, 0, 4, 3]  # the other cell has a corner of unknown height


def test_the_buffers_of_3d_need_a_role(served, browser):
    context = browser.new_context()
    for name in ("cloud", "terrain", "past-cloud", "past-terrain"):
        assert context.request.get(f"{served.address}/map/{name}.bin?product=1").status == 401
    context.close()


def test_without_webgl_the_panel_says_so_and_the_page_works(served, play):
    made = launched(play, "--disable-3d-apis")
    try:
        seat = Seat(made, served)
        seat.page.locator(".view-3d").scroll_into_view_if_needed()
        expect(seat.page.locator(".no-3d")).to_contain_text("no WebGL", timeout=WAIT_MS)
        wait_for(seat.page, "STANDBY", ".big:not(.stale)")
        seat.page.keyboard.press("Escape")
        expect(seat.page.locator("#stop-words.good")).to_contain_text("heard by the rover", timeout=WAIT_MS)
        seat.page.locator(".view-3d-card").screenshot(path=OUT / "view_3d_missing.png")
        assert not seat.complaints
    finally:
        made.close()
