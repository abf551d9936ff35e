"""Progress and cancellation of long kernel work from another thread: the kernel calls nothing back."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from onboard.records import U8


class CancelledError(Exception):
    """The work was stopped by its `Progress`; there is no result."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of one kernel call.

    done: int64 (1,), finished units, counted up by the kernel.
    stop: uint8 (1,); a value other than 0 makes the kernel return soon.
    """

    done: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))
    stop: U8 = field(default_factory=lambda: np.zeros(1, np.uint8))

    def cancel(self) -> None:
        """Cancel the work; it raises `CancelledError`."""
        self.stop[0] = 1
