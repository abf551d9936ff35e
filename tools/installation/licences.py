"""Licences of third-party packages, from the metadata of the installed packages: a page of the docs, a notice to ship.

The page lists every package of requirements.lock. The notice is installed with the program: it contains the licence
texts of the packages and lists the libraries inside them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from importlib.metadata import Distribution, distribution
from pathlib import Path

from tools.installation.extras import LOCK, closure, plain

_TEXTS = re.compile(r"(?i)(^|[-_.])(licen[cs]es?|copying|notice|copyright)([-_.]|$)")
_MOST_CHARACTERS = 60  # a longer field is a licence text, not a name
_REPLACED = """The packages lie as files of their own in `lib/el-dorado/VERSION`, below `site-packages`. Anybody
may put a changed version in the place of one, also of python-can (LGPL), which is Python files there, and
of the shared libraries inside of others (`*.libs`; GEOS in rasterio, LGPL). None is linked into a
program of ours. eclipse-zenoh may be had under Apache 2.0 or the EPL 2.0; here it is shipped under Apache 2.0."""


def licence(package: Distribution) -> str:
    """Licence of a package from its metadata; an SPDX expression if there is one. Raises LookupError."""
    fields = package.metadata
    named = fields.get("License-Expression") or fields.get("License") or ""
    classes = [row.split(" :: ")[-1] for row in fields.get_all("Classifier") or () if row.startswith("License ::")]
    if named and "\n" not in named and len(named) <= _MOST_CHARACTERS:
        return named
    if classes:
        return " or ".join(classes)
    raise LookupError(
        f"{fields['Name']} names no licence in its metadata: add it to tools/installation/licences.py by hand"
    )


def locked(text: str) -> list[str]:
    """Names in a lock file, in order."""
    return re.findall(r"^([A-Za-z0-9_.-]+)==", text, re.MULTILINE)


def page() -> str:
    """Text of docs/licences.md."""
    flown = closure()
    others = [distribution(name) for name in locked(LOCK.read_text()) if plain(name) not in flown]
    return (
        "\n\n".join(
            [
                "<!-- Made from requirements.lock and the packages' metadata by tools/make_docs.py: "
                "run `make docs`. -->",
                "# Licences of what is not ours",
                "## On the rover",
                "`make install` and `make deb` ship these. The notice with all licence texts is made with "
                "the package, `share/doc/el-dorado/copyright`.",
                _table(flown.values()),
                _REPLACED,
                "## On the bench and the ground, and to build and test",
                "`make` fetches these into `.venv`; no package of ours ships them. The tests use two more as clients:\n"
                "`hokuyolx` (MIT), which `make test` and `make bench` build, and MAVProxy (GPL-3.0) of `make clients`.",
                _table(others),
            ]
        )
        + "\n"
    )


def notice() -> str:
    """Text of the notice of an installed program: licences, libraries inside, licence texts."""
    parts = ["El Dorado is shipped with these packages; their licence texts follow.", _REPLACED]
    parts += [f"{p.metadata['Name']} {p.version}: {licence(p)}{_inside(p)}" for p in closure().values()]
    for package in closure().values():
        for name, text in licence_texts(package) or [("", "brings no licence text")]:
            parts.append(f"{'=' * 100}\n{package.metadata['Name']} {package.version}: {name}\n\n{text.strip()}")
    return "\n\n".join(parts) + "\n"


def licence_texts(package: Distribution) -> list[tuple[str, str]]:
    """Name and text of each licence file of a package."""
    found = [file for file in package.files or () if _TEXTS.search(file.name) and file.suffix not in (".py", ".pyc")]
    return [(str(file), Path(str(package.locate_file(file))).read_text(errors="replace")) for file in sorted(found)]


def _inside(package: Distribution) -> str:
    """Names of third-party libraries that a package contains as compiled files."""
    names = {re.split(r"[-.]", file.name)[0] for file in package.files or () if file.parts[0].endswith(".libs")}
    return f"; inside: {', '.join(sorted(names))}" if names else ""


def _table(packages: Iterable[Distribution]) -> str:
    rows: list[Sequence[str]] = [("package", "version", "licence"), ("---", "---", "---")]
    rows += sorted((plain(p.metadata["Name"]), p.version, licence(p)) for p in packages)
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)
