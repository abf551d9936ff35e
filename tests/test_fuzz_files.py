"""Some examples of each door of `python -m tests.fuzz_files`."""

import pytest

from tests.fuzz_files import DOORS, hunt


@pytest.mark.parametrize("door", DOORS)
def test_a_damaged_file_is_its_content_or_the_documented_error(door):
    assert hunt(door, 1, 30) < 30
