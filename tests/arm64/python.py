"""A virtual environment whose Python is a script: it calls qemu-user with the Python of an aarch64 root.

Python takes the script's place for its own (qemu's -0), so `sys.executable`, pyvenv.cfg and child processes work as
anywhere, without binfmt_misc and without a chroot. Paths are the machine's own; of the root come libraries and Python.
"""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

QEMU = "qemu-aarch64"


class Emulated:
    """The environment in `folder`; `python` is its command, `version` is as in 3.11."""

    def __init__(self, folder: Path, root: Path) -> None:
        """Raises FileNotFoundError where there is no qemu or the root has no Python."""
        interpreter = (root / "usr/bin/python3").resolve(strict=True)
        qemu = shutil.which(QEMU)
        if qemu is None:
            raise FileNotFoundError(f"no {QEMU} on this machine")
        self.root, self.version = root, interpreter.name.removeprefix("python")
        self.python, self.site = folder / "bin/python", folder / f"lib/python{self.version}/site-packages"
        for place in (self.python.parent, self.site):
            place.mkdir(parents=True, exist_ok=True)
        (folder / "pyvenv.cfg").write_text(
            f"home = {interpreter.parent}\ninclude-system-site-packages = false\nversion = {self.version}\n"
        )
        words = shlex.join(map(str, [qemu, "-L", root, "-0", self.python, interpreter]))
        self.python.write_text(f'#!/bin/sh\nexec {words} "$@"\n')
        self.python.chmod(0o755)

    @property
    def tag(self) -> str:
        """As in the names of extension modules: 311."""
        return self.version.replace(".", "")
