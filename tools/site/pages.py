"""Pages of the site from those of docs/: diagrams become pictures, files of the project outside docs/ are copied."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

FENCE = re.compile(r"^```mermaid\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_OUTSIDE = re.compile(r"\]\(\.\./([^)#\s]+)\)")
_HEADING = re.compile(r"^# (.+)$", re.MULTILINE)
_BY_FILE = re.compile(r"\[([\w-]+\.md)\]\(\1\)")
DIAGRAMS, FILES = "diagrams", "files"  # folders of the site


def diagrams(text: str) -> list[str]:
    """Mermaid sources of a page, in order."""
    return FENCE.findall(text)


def diagram_name(source: str) -> str:
    """File name of a diagram's picture: the same source has the same name."""
    return hashlib.sha256(source.encode()).hexdigest()[:16] + ".svg"


def title(text: str) -> str:
    """First heading of a page; "untitled" if it has none."""
    found = _HEADING.search(text)
    return found[1].replace("]", "") if found else "untitled"


def staged(text: str, titles: Mapping[str, str] = MappingProxyType({})) -> str:
    """Text of a page of the site: each Mermaid block is its picture, `../FILE` is `files/FILE`.

    titles: of the pages by their names; a link that shows a page's file name shows its title instead.
    """
    alternative = f"Diagram: {title(text)}"
    with_pictures = FENCE.sub(lambda found: f"![{alternative}]({DIAGRAMS}/{diagram_name(found[1])})", text)
    named = _BY_FILE.sub(lambda found: f"[{titles.get(found[1], found[1])}]({found[1]})", with_pictures)
    return _OUTSIDE.sub(lambda found: f"]({FILES}/{found[1]})", named)


def outside(texts: Iterable[str]) -> set[str]:
    """Paths, from the project's root, of the files outside docs/ that these pages link to."""
    return {path for text in texts for path in _OUTSIDE.findall(text)}


def navigation(value: object) -> list[str]:
    """Pages that a `nav` of zensical.toml names, in order. Raises ValueError for what is neither page nor section."""
    if isinstance(value, str):
        return [value]
    if isinstance(value, Mapping):
        return [page for part in value.values() for page in navigation(part)]
    if isinstance(value, list):
        return [page for part in value for page in navigation(part)]
    raise ValueError(f"nav holds {value!r}: a page's name, a section or a list is expected")


def unlisted(named: list[str], pages: Iterable[str]) -> list[str]:
    """What differs between the navigation and the pages there are, one sentence each; empty if nothing does."""
    present = set(pages)
    faults = [f"{page}: in the navigation, but docs/ has no such page" for page in named if page not in present]
    faults += [f"{page}: not in the navigation (tools/site/zensical.toml)" for page in sorted(present - set(named))]
    twice = [page for page in sorted({*named}) if named.count(page) > 1]
    return faults + [f"{page}: in the navigation {named.count(page)} times" for page in twice]


def read(docs: Path) -> dict[str, str]:
    """Name and text of each page of a folder."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(docs.glob("*.md"))}
