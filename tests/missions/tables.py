"""Table of a command: on the screen, as Markdown, and in the page of the documents that includes it.

In a page the table stands between two lines, <!-- begin NAME ... --> and <!-- end NAME -->; the command writes the text
between them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.table import Table


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return the table as Markdown: the first column to the left, figures to the right."""
    lines = [heads, ("---",) + ("---:",) * (len(heads) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def shown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    """The table for a terminal."""
    made = Table(*heads)
    for row in rows:
        made.add_row(*row)
    return made


def put(page: Path, name: str, table: str) -> None:
    """Write a table into its place in a page. Raises ValueError if the page has no such place."""
    text = page.read_text(encoding="utf-8")
    place = re.compile(rf"(<!-- begin {re.escape(name)}\b[^\n]*-->\n).*?(<!-- end {re.escape(name)} -->)", re.DOTALL)
    if not place.search(text):
        raise ValueError(f"{page}: no lines `<!-- begin {name} ... -->` and `<!-- end {name} -->` for the table")
    page.write_text(place.sub(lambda found: f"{found[1]}\n{table}\n{found[2]}", text), encoding="utf-8")
