"""The profiles of hypothesis: `make test` tries few examples of a law, `make nightly` as many as it asks for."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LAW = """
from hypothesis import given, settings, strategies as st

tried = []

@given(st.integers())
@settings(max_examples=60, database=None)
def test_a_law(number):
    tried.append(number)

def test_its_examples():
    print("examples:", len(tried))
"""


@pytest.mark.parametrize(("words", "examples"), [(("--hypothesis-profile", "fast"), 25), ((), 60)])
def test_a_law_is_tried_with_few_examples_in_the_profile_fast_and_with_its_own_number_without(
    tmp_path, words, examples
):
    (tmp_path / "test_law.py").write_text(LAW)
    command = [sys.executable, "-m", "pytest", "-s", "-c", ROOT / "pyproject.toml", "--rootdir", tmp_path, *words]
    done = subprocess.run(
        [*command, "-p", "tests.conftest", "test_law.py"], cwd=tmp_path, capture_output=True, text=True,
        env={"PATH": "/usr/bin", "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"examples: {examples}\n" in done.stdout
