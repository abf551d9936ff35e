"""`python -m tests.page`: the operator's page in a real Chromium, on a toy rover (`make test-page`).

python -m tests.page                     all checks; screenshots and figures in build/page, to be looked at
python -m tests.page -k stop             those of STOP
python -m tests.page check_past.py       one file
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

HERE = Path(__file__).parent
EX_UNAVAILABLE = 69


def main(words: list[str]) -> int:
    """Run the checks. Exit codes: those of pytest, 69 without Playwright or Chromium."""
    if find_spec("playwright") is None:
        print(
            "no Playwright: `make test-page` installs it, or `pip install -r requirements-browser.lock`",
            file=sys.stderr,
        )
        return EX_UNAVAILABLE
    from tests.page.seat import find_chromium

    if find_chromium() is None:
        print("no Chromium: `apt-get install chromium`, or name one with CHROMIUM=/path", file=sys.stderr)
        return EX_UNAVAILABLE
    named = [str(HERE / word) if (HERE / word).is_file() else word for word in words]
    files = [] if any(word.endswith(".py") for word in words) else sorted(map(str, HERE.glob("check_*.py")))
    return int(pytest.main(["-p", "no:cacheprovider", *named, *files]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
