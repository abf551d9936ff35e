"""Texts from outside are drawn as they are: `$` begins no mathematics, and no text makes a picture fail."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from pictures.film import Shot, Stage
from pictures.items import Series, items
from pictures.ldem import ldems
from pictures.mission import Story, mission
from pictures.next_position import next_position
from pictures.style import literal, png
from pictures.terrain import Ground, terrain
from pictures.way import Sets, way
from tests.pictures.test_pictures import GRID, GROUND, HEIGHTS, LINE, TIMES, plan, size

pytestmark = pytest.mark.tool

BAD = r"$\frac{$ and $x_$"
BODY_M = (0.95, 0.56)
NAMED = Ground(GRID, HEIGHTS, name=BAD)
PLAN = replace(plan(choices=2), kind=BAD, rule=BAD, reason=BAD, scoring=BAD)
NOWHERE = np.empty((0, 3))


def story() -> Figure:
    return mission(Story(NAMED, (10.0, 2.0), LINE, LINE[:2], NOWHERE, NOWHERE, [PLAN], BAD), 1.1, BODY_M)


def enumeration() -> Figure:
    return items([Series(BAD, BAD, TIMES, np.ones(len(TIMES)), None, {1: BAD})])


@pytest.mark.parametrize("make", [
    story, enumeration,
    lambda: items([Series(BAD, "V", TIMES, TIMES)]),
    lambda: ldems([PLAN], 1.1, BODY_M),
    lambda: next_position(PLAN, 1.1, BODY_M),
    lambda: terrain(NAMED, NAMED, (10.0, 2.0)),
    lambda: way(Sets(GRID, HEIGHTS, np.full((40, 80), 3, np.uint8)), LINE, LINE[:0, :2], (10.0, 2.0), BAD),
], ids=["mission", "enumeration", "item", "ldems", "next_position", "terrain", "way"])  # fmt: skip
def test_a_picture_with_dollars_in_its_texts_is_drawn(make):
    made = make()
    assert size(png(made))
    shown = [text._preprocess_math(text.get_text()) for text in made.findobj(Text)]
    assert any(BAD in words.replace("\n", " ") for words, math in shown if not math)


def test_a_film_with_dollars_in_its_texts_is_drawn():
    stage = Stage(GROUND, (10.0, 2.0), BODY_M)
    empty = Shot((0.0, 0.0, 0.0), BAD, np.zeros((4, 3)), NOWHERE, NOWHERE[:, :2], NOWHERE[:, :2])
    drawn = stage.draw(replace(empty, lines=(BAD, "50 $ and 60 $"), alarm=BAD))
    assert drawn.ndim == 3 and drawn[:30].min() < 100  # there are words
    assert literal("1 $") == r"1 \$"
