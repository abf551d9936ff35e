"""Escaping of text from outside for display: each character that is not printable becomes its escape, as `\\x1b`.

Not printable are control characters (C0, DEL, C1), characters that change the writing direction or have no width, line
and paragraph separators, blanks other than the space, and halves of surrogate pairs. A terminal or page draws the
result and executes nothing in it. Printable text stays as it is, including a backslash.
"""

from __future__ import annotations

_LAYOUT = "\n\t"


def visible(text: str) -> str:
    """Escape one line of text; a line feed in it is shown as `\\n`."""
    return text if text.isprintable() else "".join(map(_shown, text))


def visible_lines(text: str) -> str:
    """Escape text of several lines; line feeds and tabs stay."""
    return text if text.isprintable() else "".join(c if c in _LAYOUT else _shown(c) for c in text)


def _shown(character: str) -> str:
    return character if character.isprintable() else character.encode("unicode_escape").decode("ascii")
