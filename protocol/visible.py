"""Text from outside as it may be shown: every character that is not printable becomes its escape, as `\\x1b`.

Not printable are control characters (C0, DEL, C1), characters that turn the direction of writing or have no width, line
and paragraph separators, blanks other than the space, and halves of surrogate pairs. A terminal or page that is given
the result draws it and obeys nothing in it. Printable text stays as it is, a backslash too.
"""

from __future__ import annotations

_LAYOUT = "\n\t"


def visible(text: str) -> str:
    """One line of text; a line feed in it is shown as `\\n`."""
    return text if text.isprintable() else "".join(map(_shown, text))


def visible_lines(text: str) -> str:
    """Text of several lines: line feeds and tabs stay."""
    return text if text.isprintable() else "".join(c if c in _LAYOUT else _shown(c) for c in text)


def _shown(character: str) -> str:
    return character if character.isprintable() else character.encode("unicode_escape").decode("ascii")
