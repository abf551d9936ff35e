"""Lines to people and programs: the one place where `ground` writes to its output and beside it.

Whatever a line holds of the rover, a file or a client, its control characters are visible in it.
"""

from __future__ import annotations

import sys

from protocol.visible import visible, visible_lines


def line_out(line: str) -> None:
    """One line for whoever reads, at once; a line feed in it makes no second one."""
    text_out(visible(line))


def text_out(text: str) -> None:
    """Text of several lines, at once."""
    sys.stdout.write(visible_lines(text) + "\n")
    sys.stdout.flush()


def line_beside(text: str) -> None:
    """Text beside the output, at once."""
    sys.stderr.write(visible_lines(text) + "\n")
    sys.stderr.flush()
