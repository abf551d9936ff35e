"""Accessibility of the page by axe-core in a real Chromium: no serious and no critical finding."""

import json
from importlib.util import find_spec
from pathlib import Path

from tests.page.seat import OUT, wait_for


def axe_script():
    folder = Path(find_spec("axe_playwright_python").origin).parent
    return next(folder.glob("**/axe.min.js")).read_text()


def test_axe_has_no_serious_finding(operator):
    page = operator.page
    wait_for(page, "STANDBY", ".big:not(.stale)")
    page.evaluate(axe_script())
    found = page.evaluate("axe.run()")["violations"]
    (OUT / "axe.json").write_text(json.dumps(found, indent=1))
    assert not [
        (one["id"], one["help"], [node["target"] for node in one["nodes"]][:3])
        for one in found
        if one["impact"] in ("serious", "critical")
    ]
