"""`python -m tests.page.picture`: docs/pictures/page.png, the end of the flight in build/demo as the page shows it.

The archive is copied; the live rover behind the page is a toy and is not in the picture. Needs `make demo` first.
"""

import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from tests.page.seat import OUT, ROOT, WEBGL, Seat, Served, a_port, launched, wait_for


def main(archive: Path, picture: Path) -> None:
    """Draw the picture."""
    OUT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        shutil.copy(archive, Path(folder) / "archive.db")
        (Path(folder) / "boots").write_text("1000")
        served = Served(Path(folder), a_port())
        browser = launched(play, *WEBGL)
        try:
            page = Seat(browser, served).page
            page.get_by_role("combobox", name="shown").click()
            page.get_by_role("option", name="run 1").first.click()
            wait_for(page, "PAST RUN", ".big.link.bad")
            page.get_by_role("button", name="node sets").click()
            page.wait_for_load_state("networkidle")
            page.screenshot(path=picture)
        finally:
            browser.close()
            served.kill()


if __name__ == "__main__":
    main(
        Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/demo/ground/archive.db",
        Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "docs/pictures/page.png",
    )
