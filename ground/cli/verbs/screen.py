"""Output of `ground`: the only place that writes to stdout and stderr.

Control characters from the rover, a file or a client are made visible in every line.
"""

from __future__ import annotations

import sys

from protocol.visible import visible, visible_lines


def line_out(line: str) -> None:
    """Write one line to stdout at once; line feeds in it are made visible."""
    text_out(visible(line))


def text_out(text: str) -> None:
    """Write text of several lines to stdout at once."""
    sys.stdout.write(visible_lines(text) + "\n")
    sys.stdout.flush()


def line_beside(text: str) -> None:
    """Write text to stderr at once."""
    sys.stderr.write(visible_lines(text) + "\n")
    sys.stderr.flush()
