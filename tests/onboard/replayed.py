"""A record replayed in an environment of its own: `python -m tests.onboard.replayed RECORD`.

Prints as JSON whether it is identical, and digests of what the flight program asks of numpy, and of what it does not
ask.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from pathlib import Path

import numpy as np

from onboard.record.replay import replay


def asked() -> bytes:
    """numpy's sums, means and interpolations: plain C, the same order on every processor."""
    random = np.random.default_rng(1)
    x, y = random.normal(size=(37, 1001)), np.sort(random.normal(size=1001))
    cells = random.integers(0, 50, 1001)
    made = [
        x.sum(),
        x.sum(axis=0),
        x.sum(axis=1),
        x[:, ::3].mean(axis=1),
        x.mean(),
        np.cumsum(x, axis=1),
        np.median(x, axis=1),
        np.percentile(x, (10, 90)),
        np.interp(x, y, x[0]),
        np.bincount(cells, y),
        np.sqrt(np.abs(x)),
        np.round(x, 9),
        np.unwrap(4.0 * x),
        x.astype(np.float32).sum(axis=1),
        np.arange(0.1, 50.0, 0.1),
        np.linspace(-1.0, 3.0, 701),
    ]
    return b"".join(np.ascontiguousarray(part).tobytes() for part in made)


def not_asked() -> bytes:
    """What differs from one processor to the next: to see that a pretended one is another."""
    random = np.random.default_rng(2)
    x, a = random.uniform(-30.0, 30.0, 20_000), random.normal(size=(64, 64))
    return b"".join(
        [
            np.array([f(v) for v in x.tolist() for f in (math.sin, math.exp)]).tobytes(),
            (a @ a).tobytes(),
            np.linalg.inv(a).tobytes(),
            np.sin(x).tobytes(),
            np.exp(x.astype(np.float32)).tobytes(),
        ]
    )


def told(path: Path) -> dict[str, object]:
    """What a replay of all of it says."""
    verdict = replay(path)
    parts = {"asked": asked(), "not asked": not_asked()}
    digests = {name: hashlib.sha256(part).hexdigest() for name, part in parts.items()}
    return {"identical": verdict.identical, "difference": verdict.first_difference, **digests}


if __name__ == "__main__":
    print(json.dumps(told(Path(sys.argv[1]))))
