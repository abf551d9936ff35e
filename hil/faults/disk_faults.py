"""TABLE of the errors of a disk that refuses to write: fault -> errno."""

from __future__ import annotations

import errno
from collections.abc import Mapping

DISK_FAULTS: Mapping[str, tuple[int, str]] = {
    "disk_full": (errno.ENOSPC, "no room is left on the disk"),
    "disk_read_only": (errno.EROFS, "the disk has become read-only"),
}
