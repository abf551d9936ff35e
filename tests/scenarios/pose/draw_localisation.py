"""`python -m tests.scenarios.pose.draw_localisation SEED FILE.png`: a flight of the campaign as a picture."""

from __future__ import annotations

import sys
from pathlib import Path

from pictures.estimate import estimate_figure
from pictures.style import png
from tests.scenarios.pose.localisation import flown

if __name__ == "__main__":
    _, watch = flown(int(sys.argv[1]))
    Path(sys.argv[2]).write_bytes(png(estimate_figure(watch.trace)))
