"""The pages made from tables are current; what the pages name exists."""

import re
from functools import cache
from pathlib import Path

import pytest

from protocol.tables.commands import TABLE
from protocol.tables.faults import FAULTS
from tools.make_docs import DOCS, PAGES, ROOT
from tools.make_pictures import DRIVEN, MADE, SCANNED

PAGE_FILES = sorted([ROOT / "README.md", ROOT / "CHANGELOG.md", *DOCS.glob("*.md")])


@pytest.mark.parametrize("name", PAGES)
def test_the_committed_page_is_what_the_tables_make(name):
    assert (DOCS / name).read_text() == PAGES[name](), "run `make docs`"


def test_every_fault_and_command_has_a_row():
    assert all(f"| `{fault.name}` |" in PAGES["faults.md"]() for fault in FAULTS)
    assert all(f"| {row.id} | `{row.typed}` |" in PAGES["commands.md"]() for row in TABLE)


@pytest.mark.parametrize("page", PAGE_FILES, ids=lambda path: path.name)
def test_links_lead_to_files_of_the_project(page):
    links = re.findall(r"\]\(([^)#]+)\)", page.read_text())
    assert [link for link in links if not link.startswith("http") and not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", PAGE_FILES, ids=lambda path: path.name)
def test_paths_in_code_type_exist(page):
    named = re.findall(r"`((?:protocol|onboard|hil|ground|pictures|tests|tools|docs)/[\w./]*)`", page.read_text())
    assert [name for name in named if not (ROOT / name).exists()] == []


@cache
def names_of_tests():
    return {
        name
        for path in (ROOT / "tests").rglob("test_*.py")
        for name in re.findall(r"def (test_\w+)\(", path.read_text())
    }


@pytest.mark.parametrize("page", PAGE_FILES, ids=lambda path: path.name)
def test_tests_named_on_a_page_exist(page):
    assert set(re.findall(r"`(test_\w+)`", page.read_text())) <= names_of_tests()


@pytest.mark.parametrize(("page", "made"), [("as-printed.md", MADE), ("lidar-tool.md", SCANNED), ("motion.md", DRIVEN)])
def test_a_page_shows_every_picture_that_is_made_for_it(page, made):
    shown = re.findall(r"\]\(pictures/([\w.-]+)\)", (DOCS / page).read_text())
    assert shown == list(made)


PARTS = ("index.md", "tutorials.md", "how-to.md", "reference.md", "explanation.md")


def test_the_index_and_the_pages_of_its_parts_list_every_page():
    listed = {page for part in PARTS for page in re.findall(r"\]\(([\w-]+\.md)\)", (DOCS / part).read_text())}
    assert listed == {path.name for path in DOCS.glob("*.md")} - {"index.md"}


def test_make_targets_named_in_the_readme_exist():
    targets = set(re.findall(r"^([a-z0-9-]+):", Path(ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"`make ([a-z0-9-]+)", (ROOT / "README.md").read_text())) <= targets


def prose(text: str) -> list[tuple[int, str]]:
    """Number and text of each line that is no table, code, picture or heading."""
    lines, fenced = [], False
    for number, line in enumerate(text.splitlines(), 1):
        fenced ^= line.lstrip().startswith("```")
        if not fenced and not line.startswith(("|", "    ", "![", "#", "<", "```")):
            lines.append((number, line))
    return lines


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda page: page.name)
def test_prose_that_is_written_by_hand_is_at_most_120_columns_wide(page):
    text = page.read_text(encoding="utf-8")
    if not text.startswith("<!-- Made from"):
        assert [f"{page.name}:{number}" for number, line in prose(text) if len(line) > 120] == []
