"""Preallocated buffer of clock samples, and the lower-hull line fit through them."""

from __future__ import annotations

import numpy as np

from onboard.records import F64


class Frames:
    """Buffer of the newest `size` rows (turn, stamp in ms, arrival in ns); each column is contiguous.

    It has room for twice as many rows: the newest move to the front once in `size` rows.
    """

    def __init__(self, size: int) -> None:
        self._columns = np.empty((3, 2 * size))
        self._spare = np.empty((3, size))
        self._size = size
        self.clear()

    def __len__(self) -> int:
        return self._end - self._begin

    def clear(self) -> None:
        """Remove all rows."""
        self._begin = self._end = 0

    def append(self, turn: int, stamp_ms: int, arrival_ns: int) -> None:
        """Add a row; drop the oldest if there are more than `size`."""
        if self._end == 2 * self._size:
            for column in self._columns:  # one by one: numpy would copy the whole, assuming that the halves overlap
                column[: self._size] = column[self._size :]
            self._begin, self._end = 0, self._size
        at, columns = self._end, self._columns
        columns[0, at], columns[1, at], columns[2, at] = turn, stamp_ms, arrival_ns
        self._end += 1
        self._begin = max(self._begin, self._end - self._size)

    def columns(self) -> tuple[F64, F64, F64]:
        """Turns, stamps, arrivals, oldest first: views that are valid until the next row."""
        turns, stamps_ms, arrivals_ns = self._columns[:, self._begin : self._end]
        return turns, stamps_ms, arrivals_ns

    def spare(self) -> tuple[F64, F64, F64]:
        """Three work columns as long as those of the frames, with undefined content."""
        first, second, third = self._spare[:, : len(self)]
        return first, second, third


def total(x: F64, out: F64) -> float:
    """Return the sum; `out` is overwritten and may be x. Running sums: `sum`, `min` and similar allocate 1 kB."""
    return float(np.add.accumulate(x, 0, None, out)[-1])


def line_at(x: F64, line: tuple[float, float], out: F64) -> F64:
    """Fill `out` with slope * x + value at 0 and return it."""
    np.multiply(x, line[0], out=out)
    out += line[1]
    return out


def height_under(x: F64, y: F64, slope: float, spare: F64) -> float:
    """Value at 0 of the highest line of this slope under all points. spare: as long as x, overwritten."""
    above = _above(x, y, slope, spare)
    return float(above[above.argmin()])


def edge_under(x: F64, y: F64, middle: float, slope: float, spare: F64) -> tuple[float, float]:
    """(slope, value at 0) of the lower convex hull's edge over `middle`: of all lines under the points, the highest.

    x rises, with points on both sides of middle. slope: a guess. spare: as long as x, overwritten. The edge joins a
    point on the left with one on the right. While another point lies under the line of two such points, it replaces
    the one on its side: 1 or 2 times with the guess of the fit before. Points on one line within rounding could
    alternate for ever, so the number of steps is limited.
    """
    split = int(x.searchsorted(middle))
    above = _above(x, y, slope, spare)
    left, right = int(above[:split].argmin()), split + int(above[split:].argmin())
    for _ in range(len(x)):
        slope = float((y[right] - y[left]) / (x[right] - x[left]))
        above = _above(x, y, slope, spare)
        lowest = int(above.argmin())
        if above[lowest] >= min(above[left], above[right]):
            break
        left, right = (lowest, right) if lowest < split else (left, lowest)
    return slope, float(y[left] - slope * x[left])


def _above(x: F64, y: F64, slope: float, out: F64) -> F64:
    np.multiply(x, slope, out=out)
    return np.subtract(y, out, out=out)
