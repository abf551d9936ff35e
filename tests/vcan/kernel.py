"""The guest's kernel: Debian's own, from its package, unpacked beside the build and not installed."""

from __future__ import annotations

import lzma
import re
import shutil
import subprocess
from pathlib import Path

NEEDED = ("virtio_pci", "9pnet_virtio", "9p", "can_raw", "vcan", "sch_tbf")  # the last: a slow queue before vcan
_XZ = b"\xfd7zXZ\0"


class Kernel:
    """One unpacked kernel: `folder` holds boot/vmlinuz-VERSION and lib/modules/VERSION."""

    def __init__(self, folder: Path) -> None:
        packed = next((folder / "boot").glob("vmlinuz-*"))
        self.version = packed.name.removeprefix("vmlinuz-")
        self.image = folder / "vmlinux"
        if not self.image.exists():
            self.image.write_bytes(elf_image(packed.read_bytes()))
        modules = (folder / "lib/modules" / self.version / "kernel").rglob("*.ko")
        self._modules = {module.stem.replace("-", "_"): module for module in modules}

    def modules(self, names: tuple[str, ...] = NEEDED) -> list[Path]:
        """The modules of these names and those they depend on, each after what it needs.

        Raises KeyError for a module that the package has not.
        """
        ordered: list[Path] = []
        for name in names:
            path = self._modules[name]
            before = self.modules(depends(path.read_bytes()))
            ordered += [module for module in (*before, path) if module not in ordered]
        return ordered


def newest_package(folder: Path) -> Path | None:
    """The package that tools/fetch_kernel.sh has put there last, if any."""
    packages = sorted(folder.glob("linux-image-*.deb"), key=lambda path: path.stat().st_mtime)
    return packages[-1] if packages else None


def unpack(package: Path) -> Kernel:
    """Unpack a kernel's package beside itself, once."""
    folder = package.with_suffix("")
    if not folder.exists():
        half = folder.with_suffix(".half")
        shutil.rmtree(half, ignore_errors=True)
        subprocess.run(["dpkg", "-x", package, half], check=True)
        half.rename(folder)
    return Kernel(folder)


def elf_image(packed: bytes) -> bytes:
    """The kernel itself out of a vmlinuz: an emulated processor would take ten seconds to unpack it at each boot.

    Raises ValueError when it is not packed by xz, as Debian's is.
    """
    begin = packed.find(_XZ)
    image = lzma.LZMADecompressor().decompress(packed[begin:]) if begin >= 0 else b""
    if not image.startswith(b"\x7fELF"):
        raise ValueError("no kernel packed by xz in this vmlinuz")
    return image


def depends(module: bytes) -> tuple[str, ...]:
    """The names in a module's own `depends=`, with underscores."""
    found = re.search(rb"\0depends=([^\0]*)\0", module)
    return tuple(name.decode().replace("-", "_") for name in found[1].split(b",") if name) if found else ()
