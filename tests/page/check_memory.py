"""Memory of the page in a real Chromium and of its server, under steady use: flat within 20 MB.

$MINUTES is the span after a warm-up of one minute: 3 in `make test-page`, 30 in `make nightly`. Each ten seconds an
event comes down, each minute a map and a scan.
"""

import json
import os
import time
from pathlib import Path

from tests.page.seat import FIGURES, OUT, wait_for

MINUTES = float(os.environ.get("MINUTES", "3"))
WARM_UP_S, STEP_S, MOST_MB = 60.0, 10.0, 20.0


def server_mb(process):
    """Resident memory of the server."""
    lines = Path(f"/proc/{process.pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS"))


def page_mb(session):
    """The page's JavaScript heap and its array buffers, garbage collected."""
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")
    return (used["usedSize"] + used.get("embedderHeapUsedSize", 0) + used.get("backingStorageSize", 0)) / 2**20


def use(page, served, turn):
    """Ten seconds of an operator's use."""
    served.order(f"event MEMORY turn {turn}")
    if turn % 6 == 0:
        page.get_by_role("button", name="Fetch map").click()
        served.order(f"scan {0.1 * (turn % 4)}")
        page.locator(".view-3d").scroll_into_view_if_needed()  # it draws only while it is seen
    page.wait_for_timeout(1000 * STEP_S)


def test_memory_of_page_and_server_stays_flat(operator, served):
    page = operator.page
    wait_for(page, "STANDBY", ".big:not(.stale)")
    session = operator.context.new_cdp_session(page)
    begun_s, turn, samples = time.monotonic(), 0, []
    while (ran_s := time.monotonic() - begun_s) < WARM_UP_S + 60 * MINUTES:
        use(page, served, turn)
        turn += 1
        if ran_s >= WARM_UP_S:
            samples.append((round(ran_s), server_mb(served.process), page_mb(session)))
            (OUT / "memory.json").write_text(json.dumps(samples))
    _, server, browser = zip(*samples)
    FIGURES["memory_minutes"] = MINUTES
    FIGURES["memory_server_mb"], FIGURES["memory_page_mb"] = server[-1], browser[-1]
    FIGURES["memory_server_growth_mb"], FIGURES["memory_page_growth_mb"] = (
        max(one) - one[0] for one in (server, browser)
    )
    print({name: round(one, 1) for name, one in FIGURES.items() if name.startswith("memory")})
    assert int(page.locator(".view-3d").get_attribute("data-points")) > 0
    assert FIGURES["memory_server_growth_mb"] < MOST_MB and FIGURES["memory_page_growth_mb"] < MOST_MB
    assert not operator.complaints
