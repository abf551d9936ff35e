"""The blocks of docs/planning-in-a-notebook.md run in order, and each prints what the page says."""

import contextlib
import io
import re

import pytest

from tools.make_docs import DOCS

PAGE = (DOCS / "planning-in-a-notebook.md").read_text()
BLOCKS = re.findall(r"^```python\n(.*?)^```(?:\s+^```text\n(.*?)^```)?", PAGE, re.MULTILINE | re.DOTALL)
TITLES = [re.findall(r"^#+ (.*)", PAGE[: PAGE.index(code)], re.MULTILINE)[-1] for code, _ in BLOCKS]


@pytest.fixture(scope="module")
def printed():
    """What each block printed, all in one namespace."""
    namespace, texts = {}, []
    for title, (code, _) in zip(TITLES, BLOCKS):
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(compile(code, f"planning-in-a-notebook.md: {title}", "exec"), namespace)
        texts.append(said.getvalue())
    return texts


@pytest.mark.parametrize("number", range(len(BLOCKS)), ids=TITLES)
def test_a_block_prints_what_the_page_says(number, printed):
    assert printed[number] == BLOCKS[number][1]


def test_every_block_of_the_page_is_run():
    assert PAGE.count("```python") == len(BLOCKS) > 10
    assert PAGE.count("```text") == sum(bool(said) for _, said in BLOCKS)
