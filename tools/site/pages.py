"""Pages of the site from the pages of docs/: diagrams become pictures, files of the project outside docs/ are copied."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

FENCE = re.compile(r"^```mermaid\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_OUTSIDE = re.compile(r"\]\(\.\./([^)#\s]+)\)")
_HEADING = re.compile(r"^# (.+)$", re.MULTILINE)
DIAGRAMS, FILES = "diagrams", "files"  # folders of the site


def diagrams(text: str) -> list[str]:
    """Mermaid sources of a page, in order."""
    return FENCE.findall(text)


def diagram_name(source: str) -> str:
    """File name of a diagram's picture: the same source has the same name."""
    return hashlib.sha256(source.encode()).hexdigest()[:16] + ".svg"


def staged(text: str) -> str:
    """Text of a page of the site: each Mermaid block is its picture, `../FILE` is `files/FILE`."""
    title = _HEADING.search(text)
    alternative = f"Diagram: {title[1] if title else 'untitled'}".replace("]", "")
    with_pictures = FENCE.sub(lambda found: f"![{alternative}]({DIAGRAMS}/{diagram_name(found[1])})", text)
    return _OUTSIDE.sub(lambda found: f"]({FILES}/{found[1]})", with_pictures)


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
    faults += [f"{page}: in the navigation {named.count(page)} times" for page in sorted({*named}) if named.count(page) > 1]
    return faults


def read(docs: Path) -> dict[str, str]:
    """Name and text of each page of a folder."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(docs.glob("*.md"))}
