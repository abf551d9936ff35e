"""Packages of each extra of pyproject.toml: from one lock, without those that are never imported.

    onboard    a rover's computer: what flies
    ground     a station
    hil        the bench, with both of the above

`python -m tools.installation.extras` makes requirements-NAME.lock of each, a part of requirements.lock with its pins
and hashes. It names every package, so it is installed with --no-deps: by their metadata pip would bring those of
NEVER_IMPORTED too.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterable, Mapping
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

ROOT = Path(__file__).parents[2]
LOCK = ROOT / "requirements.lock"
EXTRAS = ("onboard", "ground", "hil")
BUILD = ("scikit-build-core", "nanobind", "cmake", "ninja")
NEVER_IMPORTED = {("filterpy", "matplotlib")}  # (package, what its metadata ask for): for its own pictures
_OURS = re.compile(r"el-dorado\[(.+)\]")


def plain(name: str) -> str:
    """A name of a package as PEP 503 spells it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def roots(extra: str) -> tuple[str, ...]:
    """The packages that an extra names, with those of the extras that it names. Raises KeyError for an unknown one."""
    named = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    found: dict[str, None] = {}
    for requirement in named[extra]:
        if match := _OURS.fullmatch(requirement):
            found |= {name: None for other in match[1].split(",") for name in roots(other.strip())}
        else:
            found[plain(re.split(r"[^A-Za-z0-9_.-]", requirement, maxsplit=1)[0])] = None
    return tuple(found)


def closure(names: Iterable[str] = ()) -> dict[str, Distribution]:
    """The distributions that these need, themselves included, as they are installed here. By name.

    Without names: those of the extra `onboard`. Raises PackageNotFoundError where one is not installed.
    """
    found: dict[str, Distribution] = {}
    waiting = list(names) or list(roots("onboard"))
    while waiting:
        name = plain(waiting.pop())
        if name in found:
            continue
        found[name] = distribution(name)
        for requirement in found[name].requires or ():
            needed, _, marker = requirement.partition(";")
            other = plain(re.split(r"[^A-Za-z0-9_.-]", needed.strip(), maxsplit=1)[0])
            if "extra" not in marker and (name, other) not in NEVER_IMPORTED and _applies(marker):
                waiting.append(other)
    return dict(sorted(found.items()))


def _applies(marker: str) -> bool:
    from packaging.markers import Marker  # ours through pytest and scikit-build-core

    return not marker.strip() or Marker(marker).evaluate()


def size_bytes(packages: Mapping[str, Distribution]) -> int:
    """Of their files, as they are installed here; without byte code."""
    files = {Path(str(package.locate_file(file))) for package in packages.values() for file in package.files or ()}
    return sum(path.stat().st_size for path in files if path.suffix != ".pyc" and path.is_file())


def blocks(lock: str) -> dict[str, str]:
    """Name of each package of a lock -> its lines: version and hashes."""
    found = re.findall(r"^([A-Za-z0-9_.-]+)(==.*(?:\n +--hash.*)*\n)", lock, re.MULTILINE)
    return {plain(name): name + rest for name, rest in found}


def part(extra: str, lock: str) -> str:
    """The lock of one extra. Raises KeyError where the whole one lacks a package."""
    whole = blocks(lock)
    head = f"# The extra `{extra}`: part of requirements.lock, made by `make locks`; install it with --no-deps.\n"
    return head + "".join(whole[name] for name in closure(roots(extra)))


def build_part(lock: str) -> str:
    """The lock of what builds the project."""
    whole = blocks(lock)
    head = "# What builds the project: part of requirements.lock, made by `make locks`; install it with --no-deps.\n"
    return head + "".join(whole[name] for name in closure(BUILD))


def parts() -> dict[Path, str]:
    """Every file that this makes, with its text."""
    lock = LOCK.read_text()
    made = {ROOT / f"requirements-{extra}.lock": part(extra, lock) for extra in EXTRAS}
    return {**made, ROOT / "requirements-build.lock": build_part(lock)}


def main() -> int:
    """Write the locks; print number and size of each extra's packages."""
    try:
        for path, text in parts().items():
            path.write_text(text)
        for extra in EXTRAS:
            packages = closure(roots(extra))
            print(f"{extra}: {len(packages)} packages, {size_bytes(packages) / 1e6:.0f} MB")
    except (PackageNotFoundError, KeyError) as error:
        print(f"extras: {error}: install requirements.lock, or make it again (tools/make_lock.sh)", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
