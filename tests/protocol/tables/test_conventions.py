"""Texts on the wire."""

import pytest

from protocol.conventions import cut


@pytest.mark.parametrize("text", ["", "short", "x" * 20, "ä" * 10])
def test_a_text_that_fits_crosses_whole(text):
    assert cut(text, 20).decode() == text


@pytest.mark.parametrize("text", ["x" * 21, "ä" * 11, "a" + "€" * 9])
def test_a_text_that_is_cut_ends_with_an_ellipsis_within_its_bytes(text):
    raw = cut(text, 20)
    assert len(raw) <= 20
    kept, end = raw.decode()[:-1], raw.decode()[-1]
    assert end == "…" and text.startswith(kept) and len(kept.encode()) >= 15
