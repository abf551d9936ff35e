"""Provenance of a record: versions of the packages, commit and digest of the program, and its wire tables."""

from __future__ import annotations

import hashlib
import json
import platform
import subprocess
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path

COMMIT = "commit.txt"  # in onboard's folder if the program was installed (tools/installation/install.py)
WIRES = ("rover.dbc", "eldorado.xml")
_PACKAGES = ("numpy", "scipy", "filterpy", "small-gicp", "python-can", "eclipse-zenoh", "mcap")
_SITE = Path(__file__).parents[2]  # holds protocol, transport and onboard
_VERSIONS = "versions.json"
_LIMIT_S = 5.0


def versions_file() -> tuple[str, bytes, str]:
    """Name, content and media type of the attachment."""
    rows = {name: version(name) for name in _PACKAGES}
    made = {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "commit": commit(_SITE),
        "sources_sha256": sources_sha256(_SITE),
        **rows,
    }
    return _VERSIONS, json.dumps(made).encode(), "application/json"


def wires() -> Iterator[tuple[str, bytes]]:
    """Yield name and content of the tables that decode the bytes in a record."""
    for name in WIRES:
        yield name, (_SITE / "protocol" / name).read_bytes()


def versions(attached: Mapping[str, bytes]) -> dict[str, str]:
    """Versions of the program that made a record; empty if the record was cut off before them or has none."""
    try:
        found = json.loads(attached.get(_VERSIONS, b"{}"))
    except (ValueError, RecursionError):
        found = {}
    return {name: str(told) for name, told in found.items()} if isinstance(found, dict) else {}


def another_program(attached: Mapping[str, bytes]) -> str:
    """Sentence for a record made by other sources than these; "" if made by these, or unknown."""
    told = versions(attached)
    if told.get("sources_sha256", own := sources_sha256(_SITE)) == own:
        return ""
    return f"made by another program: commit {told.get('commit', 'unknown')}, this is {commit(_SITE)}"


def commit(site: Path) -> str:
    """Commit of the program in this folder, from its installation or its checkout, else "unknown"."""
    installed = site / "onboard" / COMMIT
    if installed.exists():
        return installed.read_text().strip()
    if not (site / ".git").exists():
        return "unknown"  # git would search the parent folders and find a foreign repository
    command = ["git", "-c", "safe.directory=*", "-C", str(site), "rev-parse", "HEAD"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=_LIMIT_S)
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return done.stdout.strip()


def sources_sha256(site: Path) -> str:
    """SHA-256 over path and content of each module that flies. A commit does not identify a changed checkout."""
    whole = hashlib.sha256()
    for package in ("onboard", "protocol", "transport"):
        for path in sorted((site / package).rglob("*.py")):
            whole.update(f"{path.relative_to(site)}\0".encode())
            whole.update(path.read_bytes())
    return whole.hexdigest()
