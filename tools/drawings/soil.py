"""Measure and draw slip over slope for docs/soil.md: python -m tools.drawings.soil [FOLDER]; takes a minute."""

from __future__ import annotations

import sys
from pathlib import Path

from hil.plant.slopes import SLOPES_DEG, slip
from pictures import slopes
from pictures.style import png

FOLDER = Path(__file__).parents[2] / "docs" / "pictures"
SOILS = ("firm", "nominal", "soft")


def main(folder: Path) -> None:
    """Write the picture, print the figures as a table for the page."""
    ratios = {soil: [slip(soil, deg) for deg in SLOPES_DEG] for soil in SOILS}
    (folder / "soil-slip.png").write_bytes(png(slopes.slip(SLOPES_DEG, ratios)))
    print(f"| slope | {' | '.join(SOILS)} |\n|{' --- |' * (len(SOILS) + 1)}")
    for k, deg in enumerate(SLOPES_DEG):
        print(f"| {deg:g}° | {' | '.join(f'{100 * ratios[soil][k]:.1f} %' for soil in SOILS)} |")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
