"""Ctrl-C while a command loads its modules ends it without a traceback."""

import subprocess
import sys

import pytest

LOADING = """
import signal, sys
sys.argv[0] = {name!r}
from onboard import quiet_start
while_loading = signal.getsignal(signal.SIGINT)
quiet_start.loaded()
print(while_loading.name if while_loading is signal.SIG_DFL else "kept", signal.getsignal(signal.SIGINT).__name__)
"""


@pytest.mark.parametrize(("name", "while_loading"), [
    ("/usr/bin/onboard", "SIG_DFL"), ("/here/hil/__main__.py", "SIG_DFL"), ("ground", "SIG_DFL"), ("pytest", "kept"),
])  # fmt: skip
def test_a_command_ends_at_once_while_it_loads_and_raises_afterwards_and_other_programs_are_left_alone(
    name, while_loading
):
    ran = subprocess.run([sys.executable, "-c", LOADING.format(name=name)], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == [while_loading, "default_int_handler"], ran.stderr


@pytest.mark.parametrize("command", ["onboard", "hil", "ground"])
def test_each_command_loads_it_before_anything_that_takes_time(command):
    code = f"""
import sys
class Stop:
    def find_spec(self, name, path=None, target=None):
        if name in ("json", "click", "typer", "sqlite3", "faulthandler", "gc", "os", "numpy"):
            sys.exit("onboard.quiet_start" in sys.modules and 7)
for name in ("json", "click", "typer", "sqlite3"):
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Stop())
import {command}.__main__
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 7
