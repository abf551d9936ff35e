"""Page of the report: headings, tables and pictures as one self-contained HTML text."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Sequence
from html import escape as escape_html
from typing import NamedTuple

from protocol.visible import visible_lines

_CSS = """
:root { --ink: #1d1f23; --soft: #5f6670; --line: #dfe2e6; --good: #00694c; --bad: #a33c00; }
* { box-sizing: border-box; }
body { font: 16px/1.55 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: var(--ink); background: #fff;
  margin: 0 auto; max-width: 62rem; padding: 2rem 1.5rem 4rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .4rem; }
h2 { font-size: 1.25rem; margin: 2.6rem 0 .6rem; padding-top: .8rem; border-top: 1px solid var(--line); }
p { margin: .5rem 0; max-width: 48rem; }
.verdict { display: inline-block; font-weight: 600; color: #fff; padding: .1rem .7rem; border-radius: .3rem; }
.good { background: var(--good); } .bad { background: var(--bad); } .open { background: var(--soft); }
.soft, figcaption { color: var(--soft); font-size: .92rem; }
.numbers { display: flex; flex-wrap: wrap; gap: .6rem 1.9rem; margin: 1.2rem 0; }
.numbers div { min-width: 5rem; } .numbers b { display: block; font-size: 1.45rem; line-height: 1.2; }
table { border-collapse: collapse; width: 100%; font-size: .93rem; margin: .6rem 0 1.2rem; }
th, td { text-align: left; vertical-align: top; padding: .3rem .8rem .3rem 0; border-bottom: 1px solid var(--line); }
th { font-weight: 600; } .short { white-space: nowrap; }
.facts th { width: 15rem; font-weight: 400; color: var(--soft); }
nav ul { list-style: none; display: flex; flex-wrap: wrap; gap: .2rem 1.3rem; padding: 0; margin: 1rem 0; }
a { color: #0b5cad; } .wide { overflow-x: auto; }
code, .hash { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: .82em; overflow-wrap: anywhere; }
figure { margin: 1rem 0; } img { max-width: 100%; height: auto; display: block; margin: 0 auto; }
@media print { nav { display: none; } body { font-size: 10.5pt; max-width: none; padding: 0; }
  h2 { break-after: avoid; } figure, tr { break-inside: avoid; }
  .verdict { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
"""


def escape(text: str) -> str:
    """Return text as HTML: control characters visible, mark-up escaped."""
    return escape_html(visible_lines(text))


_SHORT = ' class="short"'


class Section(NamedTuple):
    """Heading with its body, which is HTML already."""

    title: str
    body: str


def page(title: str, head: str, sections: Iterable[Section]) -> str:
    """Return the whole file. head: HTML above the first section."""
    shown = [section for section in sections if section.body]
    parts = "".join(f'<section id="{anchor(s.title)}"><h2>{escape(s.title)}</h2>\n{s.body}</section>\n' for s in shown)
    links = "".join(f'<li><a href="#{anchor(s.title)}">{escape(s.title)}</a></li>' for s in shown)
    contents = f'<nav aria-label="Contents"><ul>{links}</ul></nav>\n'
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_CSS}</style></head>\n<body>\n{head}\n{contents}{parts}</body></html>\n"
    )


def anchor(title: str) -> str:
    """Return a section's name in links: its words in small letters."""
    return "-".join(re.findall(r"[a-z0-9]+", title.lower()))


def paragraph(text: str, kind: str = "") -> str:
    """Return plain text as a paragraph."""
    return f'<p class="{kind}">{escape(text)}</p>\n' if kind else f"<p>{escape(text)}</p>\n"


def verdict(good: bool | None, text: str) -> str:
    """Return a word on a coloured patch; good None: neither good nor bad."""
    kind = "open" if good is None else "good" if good else "bad"
    return f'<span class="verdict {kind}">{escape(text)}</span>'


def numbers(pairs: Sequence[tuple[str, str]]) -> str:
    """Return large numbers with their names, side by side."""
    boxes = "".join(f"<div><b>{escape(number)}</b>{escape(name)}</div>" for name, number in pairs)
    return f'<div class="numbers">{boxes}</div>\n'


def facts(pairs: Sequence[tuple[str, str]]) -> str:
    """Return names and values in two columns; "" if there are none."""
    rows = "".join(f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>\n" for name, text in pairs)
    return f'<div class="wide"><table class="facts">\n{rows}</table></div>\n' if pairs else ""


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], hashes: bool = False) -> str:
    """Return a table with column heads. hashes: the last column is in a narrow font that may break anywhere."""
    top = "".join(f"<th>{escape(head)}</th>" for head in heads)
    body = ""
    for row in rows:
        cells = [escape(cell) for cell in row]
        if hashes:
            cells[-1] = f'<span class="hash">{cells[-1]}</span>'
        body += "<tr>" + "".join(f"<td{_SHORT if len(c) <= 18 else ''}>{c}</td>" for c in cells) + "</tr>\n"
    if not rows:
        return ""
    return f'<div class="wide"><table><thead><tr>{top}</tr></thead><tbody>\n{body}</tbody></table></div>\n'


def picture(png: bytes, caption: str) -> str:
    """Return a PNG embedded in the page; the caption is also its alternative text."""
    data = base64.b64encode(png).decode()
    text = escape(caption)
    return f'<figure><img alt="{text}" src="data:image/png;base64,{data}"><figcaption>{text}</figcaption></figure>\n'
