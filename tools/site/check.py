"""Check of the built site: each link has its target, each anchor its place, no page loads anything from the network."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

_LOADS = {"script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src", "link": "href"}
_NOT_LOADED = {"canonical", "prev", "next", "alternate", "edit"}  # relations of <link> that load nothing
_CSS = re.compile(r"(?:url\(\s*['\"]?|@import\s+['\"])([^'\")]+)")


@dataclass(frozen=True, slots=True)
class Page:
    """One page as it was built."""

    anchors: set[str] = field(default_factory=set)
    links: list[str] = field(default_factory=list)  # addresses a reader may follow
    loads: list[str] = field(default_factory=list)  # addresses the browser loads by itself


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.page = Page()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.page.anchors.update(value for name in ("id", "name") if (value := found.get(name)))
        if tag == "a" and (target := found.get("href")) is not None:
            self.page.links.append(target)
        relations = set((found.get("rel") or "").split())
        if tag in _LOADS and (target := found.get(_LOADS[tag])) and not relations & _NOT_LOADED:
            self.page.loads.append(target)


def read(text: str) -> Page:
    """Anchors, links and loaded files of a page."""
    reader = _Reader()
    reader.feed(text)
    reader.close()
    return reader.page


def faults(site: Path) -> list[str]:
    """One sentence for each fault of the site in this folder; empty if it has none. Raises OSError if unreadable."""
    pages = {path.resolve(): read(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    if not pages:
        return [f"{site}: no page"]
    found = [f"{path.relative_to(site.resolve())}: {fault}" for path in pages for fault in _of_page(site, path, pages)]
    for style in sorted(site.rglob("*.css")):
        found += [f"{style.relative_to(site)}: {fault}" for fault in _of_style(style)]
    return found


def _of_page(site: Path, path: Path, pages: dict[Path, Page]) -> Iterator[str]:
    page = pages[path]
    for target in page.loads:
        if urlsplit(target).netloc:
            yield f"loads {target} from the network"
    for target in (*page.links, *page.loads):
        parts = urlsplit(target)
        if parts.scheme or parts.netloc:
            continue
        root = site if parts.path.startswith("/") else path.parent
        goal = (root / unquote(parts.path).lstrip("/")).resolve() if parts.path else path
        goal = goal / "index.html" if goal.is_dir() else goal
        if not goal.is_file():
            yield f"{target} leads nowhere"
        elif parts.fragment and goal in pages and unquote(parts.fragment) not in pages[goal].anchors:
            yield f"{target}: the page has no such place"


def _of_style(style: Path) -> Iterator[str]:
    for target in _CSS.findall(style.read_text(encoding="utf-8")):
        parts = urlsplit(target)
        if parts.netloc:
            yield f"loads {target} from the network"
        elif not parts.scheme and parts.path and not (style.parent / unquote(parts.path)).is_file():
            yield f"{target} leads nowhere"
