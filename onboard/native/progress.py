"""How long work of a kernel can be watched and stopped from another thread: the kernel calls nothing back."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from onboard.records import U8


class CancelledError(Exception):
    """The work was stopped by its `Progress`; there is no result."""


@dataclass(frozen=True, slots=True)
class Progress:
    """done: int64 (1,), units done so far, counted up by the kernel. stop: uint8 (1,); not 0 makes it return soon."""

    done: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    stop: U8 = field(default_factory=lambda: np.zeros(1, np.uint8))

    def cancel(self) -> None:
        """The work that was given this raises `CancelledError`."""
        self.stop[0] = 1
