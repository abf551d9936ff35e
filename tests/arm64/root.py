"""An aarch64 Debian without root: packages of this machine's release, fetched by apt, unpacked, their scripts not run.

apt works on folders of its own, where nothing is installed yet, so it fetches all that PACKAGES depend on.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

PACKAGES = ("python3", "libpython3-dev", "libstdc++6")
_MADE = ".made"


class RootError(RuntimeError):
    """The root cannot be made; the text is apt's own and what to do."""


def make(folder: Path) -> Path:
    """The root in `folder`, fetched and unpacked once. Raises RootError."""
    root = folder / "root"
    if (root / _MADE).exists() and (root / _MADE).read_text().split() == list(PACKAGES):
        return root
    half = folder / "root.half"
    for old in (half, root):
        shutil.rmtree(old, ignore_errors=True)
    for package in fetch(folder / "apt"):
        subprocess.run(["dpkg-deb", "-x", package, half], check=True)
    (half / _MADE).write_text(" ".join(PACKAGES))
    half.rename(root)
    return root


def fetch(apt: Path) -> list[Path]:
    """The packages and all that they depend on. Raises RootError where apt cannot get them."""
    packages = apt / "archives"
    for place in (apt / "lists/partial", packages / "partial"):
        place.mkdir(parents=True, exist_ok=True)
    (apt / "status").touch()
    _apt(apt, "update")
    _apt(apt, "install", "--download-only", "--no-install-recommends", "-y", *PACKAGES)
    return sorted(packages.glob("*.deb"))


def _apt(apt: Path, *words: str) -> None:
    settings = {
        "APT::Architecture": "arm64",
        "APT::Architectures": "arm64",
        "APT::Sandbox::User": "root",
        "Dir::State": apt,
        "Dir::State::status": apt / "status",
        "Dir::Cache": apt,
        "Dir::Cache::archives": apt / "archives",
        "Debug::NoLocking": "true",
        "APT::Keep-Downloaded-Packages": "true",
    }
    options = [word for name, value in settings.items() for word in ("-o", f"{name}={value}")]
    done = subprocess.run(["apt-get", "-qq", *options, *words], check=False, capture_output=True, text=True)
    if done.returncode:
        raise RootError(
            f"apt-get {words[0]} for arm64 failed; this machine's apt sources must be Debian's and name no other"
            f" architecture alone:\n{done.stderr.strip()[-1000:]}"
        )
