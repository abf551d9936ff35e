"""Runner of the Python blocks in docs/planning-in-a-notebook.md, in order in one namespace, with their output.

`python -m tools.make_notebook` writes the output below each block (`make docs`); a test compares it with the page.
"""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Iterator

from tools.make_docs import DOCS

PAGE = DOCS / "planning-in-a-notebook.md"
BLOCK = re.compile(r"^```python\n(.*?)^```(?:(\s+)^```text\n(.*?)^```)?", re.MULTILINE | re.DOTALL)


def said(page: str) -> Iterator[str]:
    """Run the blocks of the page; yield the output of each."""
    namespace: dict[str, object] = {}
    for number, block in enumerate(BLOCK.finditer(page), 1):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(block[1], f"{PAGE.name}: block {number}", "exec"), namespace)
        yield out.getvalue()


def main() -> None:
    """Write the page with the current output."""
    page = PAGE.read_text()
    words = said(page)
    PAGE.write_text(BLOCK.sub(lambda block: _anew(block, next(words)), page))


def _anew(block: re.Match[str], printed: str) -> str:
    space = block[2] or "\n\n"
    return f"```python\n{block[1]}```" + (f"{space}```text\n{printed}```" if printed else "")


if __name__ == "__main__":
    main()
