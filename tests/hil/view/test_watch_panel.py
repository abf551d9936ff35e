"""Words on the watch page: texts of events are shown as they are and are no mark-up."""

import re
from html import unescape

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from hil.view.browser.panel import event_line, status
from hil.view.story import Instant, Moment, StoryEvent
from protocol.visible import visible

pytestmark = pytest.mark.tool

RENDER = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"]).render
NO_WAY = np.empty((0, 3))
HOSTILE = (
    "<img src=x onerror=alert(1)>", "<script>alert(1)</script>", "[click](javascript:alert(1))", "![](/etc/passwd)",
    "![x](picture.png)", "&lt;b&gt;", "a\n\n# heading\n", "`code`", "**bold** _it_ ~~no~~", "</li></ul><h1>", "<!-- ",
    "\x1b[2J\x9b\u202e", "| a | b |\n|---|---|\n", "\\<b>", "&#60;b&#62;", "{alert(1)}", "<https://x.example>", "]]>",
)  # fmt: skip


def shown(markdown: str) -> tuple[set[str], str]:
    """The tags of the page, and its text."""
    html = RENDER(markdown)
    return set(re.findall(r"<[^>]*>", html)), unescape(re.sub(r"<[^>]*>", "", html))


def holds(text: str) -> None:
    for severity in ("info", "fault", text):
        tags, words = shown(event_line(StoryEvent(1.0, severity, text, text)))
        assert tags <= {"<ul>", "</ul>", "<li>", "</li>", "<strong>", "</strong>"}
        assert words.count(visible(text).strip()) == 2 or not text.strip()


@pytest.mark.parametrize("text", HOSTILE)
def test_the_text_of_an_event_is_shown_as_it_is_and_is_no_html(text):
    holds("a" + text + "b")


@settings(max_examples=200, derandomize=True, deadline=None)
@given(st.text(st.characters(codec="utf-8") | st.sampled_from("<>&[]()!`*_~#|\\{}\n"), min_size=1, max_size=40))
def test_no_text_is_mark_up(text):
    holds("a" + text + "b")


@pytest.mark.parametrize("text", HOSTILE)
def test_faults_and_contacts_of_a_foreign_file_are_no_html(text):
    moment = Moment(1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0), (0.0,) * 4, (0.0,) * 4, "a" + text)
    tags, words = shown(status(Instant(1.0, moment, (), None, 0, (), ("a" + text,), NO_WAY, NO_WAY), 2.0, 0.0))
    assert tags <= {"<p>", "</p>", "<strong>", "</strong>"} and words.count(visible("a" + text).strip()) == 2
