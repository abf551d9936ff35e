"""The blocks of docs/planning-in-a-notebook.md run in order, and each prints what the page says."""

import re

import pytest

from tools import make_notebook

PAGE = make_notebook.PAGE.read_text()
BLOCKS = [(code, text) for code, _, text in make_notebook.BLOCK.findall(PAGE)]
TITLES = [re.findall(r"^#+ (.*)", PAGE[: PAGE.index(code)], re.MULTILINE)[-1] for code, _ in BLOCKS]


@pytest.fixture(scope="module")
def printed():
    """Output of each block, all run in one namespace."""
    return list(make_notebook.said(PAGE))


@pytest.mark.parametrize("number", range(len(BLOCKS)), ids=TITLES)
def test_a_block_prints_what_the_page_says(number, printed):
    assert printed[number] == BLOCKS[number][1]


def test_every_block_of_the_page_is_run():
    assert PAGE.count("```python") == len(BLOCKS) > 10
    assert PAGE.count("```text") == sum(bool(said) for _, said in BLOCKS)
