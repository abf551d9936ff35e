"""Words for people in place of texts of events that have to be read twice. The archive keeps the rover's own texts.

The texts are part of each record and of its hashes, so the flight program keeps them.
"""

from __future__ import annotations

import re
from collections.abc import Callable

_NUMBER = r"(\d+(?:\.\d+)?)"
Words = Callable[[re.Match[str]], str]


def _arrived(found: re.Match[str]) -> str:
    away_m = float(found[1])
    off = f"{100 * away_m:.0f} cm" if away_m < 1.0 else f"{away_m:.2f} m"
    return f"arrived, {off} off"


RULES: tuple[tuple[re.Pattern[str], Words], ...] = (
    (
        re.compile(rf"the goal is reached over free poses: {_NUMBER} m to {_NUMBER} m from it"),
        lambda found: f"path found, {found[1]} m over free poses; it ends {found[2]} m from the goal",
    ),
    (re.compile(rf"{_NUMBER} m from the goal, no nearer pose is free"), _arrived),
    (
        re.compile(rf"{_NUMBER} of the points lie where the target is: {_NUMBER} needed"),
        lambda found: (
            f"scan and map overlap in {100 * float(found[1]):.0f} % of the points; "
            f"{100 * float(found[2]):.0f} % are needed"
        ),
    ),
    (re.compile(r"OPERATOR: the operator says stop, safe or emergency_stop"), lambda _: "OPERATOR: stopped by command"),
    (re.compile(r"OPERATOR: the operator says (\w+)"), lambda found: f"OPERATOR: {found[1]} by command"),
    (
        re.compile(r"\bstarted again, boot (\d+)"),
        lambda found: f"the flight program has started again, boot {found[1]}",
    ),
    (re.compile(r"\b1 steps\b"), lambda _: "1 step"),
)


def event_words(text: str) -> str:
    """Return the text of an event or a report as it is shown; a text that no rule knows is returned as it is."""
    for pattern, words in RULES:
        text = pattern.sub(words, text)
    return text
