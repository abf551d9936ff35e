"""`make deb`: a Debian package of the tree that `make install` writes below build/deb/root, without Debian's tools.

A .deb is an `ar` of three members: debian-binary ("2.0"), control.tar.gz (fields, conffiles, checksums, the scripts of
tools/installation/service) and data.tar.gz. Owners, times and order are fixed: the same tree gives the same bytes.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import io
import os
import platform
import shutil
import sys
import tarfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from tools.installation.install import SERVICE, Place, install, version

SCRIPTS = ("postinst", "prerm", "postrm")
ARCHITECTURES = {"x86_64": "amd64", "aarch64": "arm64"}
PYTHON_DEPENDS = f"python{sys.version_info.major}.{sys.version_info.minor}"  # whose packages were tested
DEPENDS = f"{PYTHON_DEPENDS}, libc6 (>= 2.34), libstdc++6 (>= 12), systemd | passwd"
ABOUT = """flight program of a four-wheel-steered rover
 Reads a scanner and a CAN bus, maps, plans and drives; commanded over a link.
 With its Python packages in an environment of its own, a systemd unit, and an
 example configuration in /etc/el-dorado."""


def fields(number: str, architecture: str, size_kib: int) -> str:
    """Text of the control file."""
    rows = {
        "Package": "el-dorado",
        "Version": number,
        "Architecture": architecture,
        "Section": "science",
        "Priority": "optional",
        "Maintainer": "El Dorado <root@localhost>",
        "Installed-Size": str(size_kib),
        "Depends": DEPENDS,
        "Recommends": "can-utils, rt-tests",
        "Description": ABOUT,
    }
    return "".join(f"{name}: {value}\n" for name, value in rows.items())


def package(root: Path, number: str, architecture: str, epoch_s: int) -> bytes:
    """Build the .deb of a tree; files in its etc/ are conffiles, which an upgrade leaves unchanged."""
    paths = sorted(path for path in root.rglob("*"))
    files = [path for path in paths if path.is_file() and not path.is_symlink()]
    size_kib = sum(-(-path.stat().st_size // 1024) for path in files)
    sums = "".join(f"{hashlib.md5(path.read_bytes()).hexdigest()}  {path.relative_to(root)}\n" for path in files)
    confs = "".join(f"/{path.relative_to(root)}\n" for path in files if path.relative_to(root).parts[0] == "etc")
    control = {
        "control": (fields(number, architecture, size_kib).encode(), 0o644),
        "conffiles": (confs.encode(), 0o644),
        "md5sums": (sums.encode(), 0o644),
        **{name: ((SERVICE / name).read_bytes(), 0o755) for name in SCRIPTS},
    }
    return ar(
        {
            "debian-binary": b"2.0\n",
            "control.tar.gz": _zipped(_control_tar(control, epoch_s)),
            "data.tar.gz": _zipped(_data_tar(root, paths, epoch_s)),
        },
        epoch_s,
    )


def ar(members: Mapping[str, bytes], epoch_s: int) -> bytes:
    """Build an archive of ar(5): a header of 60 characters for each member, each at an even offset."""
    made = [b"!<arch>\n"]
    for name, data in members.items():
        made.append(f"{name:<16}{epoch_s:<12}{0:<6}{0:<6}{'100644':<8}{len(data):<10}`\n".encode())
        made.append(data + b"\n" * (len(data) % 2))
    return b"".join(made)


def _control_tar(members: Mapping[str, tuple[bytes, int]], epoch_s: int) -> bytes:
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w", format=tarfile.GNU_FORMAT) as tar:
        for name, (data, mode) in members.items():
            row = tarfile.TarInfo(f"./{name}")
            row.size, row.mode, row.mtime = len(data), mode, epoch_s
            row.uname = row.gname = "root"
            tar.addfile(row, io.BytesIO(data))
    return made.getvalue()


def _data_tar(root: Path, paths: Iterable[Path], epoch_s: int) -> bytes:
    def plain(row: tarfile.TarInfo) -> tarfile.TarInfo:
        row.uid = row.gid = 0
        row.uname = row.gname = "root"
        row.mtime = epoch_s
        row.mode = 0o755 if row.isdir() or row.mode & 0o100 else 0o644
        return row

    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w", format=tarfile.GNU_FORMAT) as tar:
        for path in paths:
            tar.add(path, f"./{path.relative_to(root)}", recursive=False, filter=plain)
    return made.getvalue()


def _zipped(data: bytes) -> bytes:
    return gzip.compress(data, 6, mtime=0)


def main() -> int:
    """Command line of `make deb`."""
    parser = argparse.ArgumentParser(prog="tools.installation.make_deb", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/deb"))
    out: Path = parser.parse_args().out
    architecture = ARCHITECTURES.get(platform.machine(), platform.machine())
    root = out.absolute() / "root"
    shutil.rmtree(root, ignore_errors=True)
    number = version()
    # Debian's own interpreter, of the version in whose environment the packages were tested
    python = f"/usr/bin/python{sys.version_info.major}.{sys.version_info.minor}"
    install(Place(Path("/usr"), str(root), Path("/etc"), number, python))
    target = out / f"el-dorado_{number}_{architecture}.deb"
    target.write_bytes(package(root, number, architecture, int(os.environ.get("SOURCE_DATE_EPOCH", "0"))))
    shutil.rmtree(root)
    print(f"{target}, {target.stat().st_size >> 20} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
