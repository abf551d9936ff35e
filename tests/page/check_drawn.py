"""Drawings of the page in a real Chromium: the ellipse of the place, the wheels, the layer of deviations.

The toy rover says 1 sigma of 0.4 m and 0.1 m, the long axis at 30 degrees; its wheels steer half of what is ordered.
"""

import pytest

from tests.page.seat import wait_for

SPY = """() => {
  window.ellipses = [];
  const real = CanvasRenderingContext2D.prototype.ellipse;
  CanvasRenderingContext2D.prototype.ellipse = function (...all) {
    window.ellipses.push(all);
    return real.apply(this, all);
  };
}"""
ORDERED_RAD = {1: 0.6, 2: -0.6, 3: -0.4, 4: 0.4}


def test_the_covariance_is_an_ellipse_with_its_axes_and_its_direction(operator):
    page = operator.page
    wait_for(page, "STANDBY", ".big:not(.stale)")
    page.wait_for_function("document.querySelector('[data-item=sigma_major_m]').textContent.includes('0.40')")
    page.evaluate(SPY)
    page.wait_for_function("window.ellipses.length > 0")
    _, _, major_px, minor_px, turn_rad, *_ = page.evaluate("window.ellipses.at(-1)")
    assert major_px / minor_px == pytest.approx(4.0, rel=1e-3)
    assert turn_rad == pytest.approx(-0.5236, abs=1e-3)  # the canvas has y down


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_a_wheel_is_turned_as_reported_and_outlined_as_ordered(operator, number):
    page = operator.page
    page.wait_for_selector(f"[data-wheel='{number}'] .ordered")
    turned = [
        float(page.locator(f"[data-wheel='{number}'] .{kind}").get_attribute("transform").split("rotate(")[1][:-1])
        for kind in ("reported", "ordered")
    ]
    ordered_deg = -ORDERED_RAD[number] * 57.29578  # an SVG turns clockwise
    assert turned == pytest.approx([ordered_deg / 2, ordered_deg], abs=0.01)
    wait_for(page, "/", ".wheels td")


def test_the_layer_of_deviations_is_drawn_after_it_was_fetched(operator, served):
    page = operator.page
    page.get_by_role("button", name="Fetch map").click()
    wait_for(page, "get ldem", ".commands article.good")
    served.order("height_std")
    with page.expect_response(lambda one: "layer=deviation" in one.url and one.ok):
        page.get_by_role("button", name="deviation", exact=True).click()
    wait_for(page, "20 cm and more", ".legend")
    page.wait_for_timeout(2500)
    operator.shot("deviation")
