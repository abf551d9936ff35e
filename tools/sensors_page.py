"""docs/sensors.md: what the emulated sensors get wrong, from the tables in hil/devices."""

from __future__ import annotations

import dataclasses

from hil.devices.errors import USUAL
from hil.devices.lidar_profile import PROFILES

_HEAD = """<!-- Made from hil/devices/errors.py and lidar_profile.py by `make docs`. -->
# Noise of the emulated sensors

Each figure is a default; a scenario changes it in its own file, and unknown keys are refused:

```toml
[sensors.tilt]
backlash_rad = 0.004

[sensors.imu]
lever_x_m = 0.12
```

Sources: [DBC] range of the wire, [STUDY] the study of scanner and tilt axis, [?] none known: a guess of the class of
part. Backlash and lever are 0 unless set, since every published figure was flown without them. Every node draws from a
generator of its own, a child of the scenario's seed.
"""
_SCANNER_HEAD = """## The scanner

Ranges come in steps of 1 mm. Each of the 1081 beams is cast at its own time, 17.36 µs after the one before, and at the
tilt and place that the scanner has then. Its clock counts 24 bits of ms and wraps. The columns are the profiles of
`hil/devices/lidar_profile.py`, which names their sources; missions fly `ideal`, `hil lidar` has them all.

"""
_SCANNER = {
    "noise_near_m": "sigma of a range to 10 m",
    "noise_far_m": "sigma beyond",
    "near_m": "nearer: the code for too near",
    "far_m": "farther: the code for no return",
    "grazing_rad": "surfaces seen flatter return nothing; 0: all return",
    "dropout_ratio": "share of the beams that return nothing",
    "rate_error": "of its clock",
    "motor_jitter_ns": "sigma of each turn's start",
    "jitter_ns": "sigma of what a scan waits for the wire",
}


def page() -> str:
    """The text."""
    parts = [_HEAD]
    for part in dataclasses.fields(USUAL):
        errors = getattr(USUAL, part.name)
        rows = [
            (f"`{each.name}`", f"{getattr(errors, each.name):.5g}", each.metadata["meaning"])
            for each in dataclasses.fields(errors)
        ]
        parts.append(f"## `[sensors.{part.name}]`\n\n" + _table(("key", "default", "source and meaning"), rows))
    heads = ("value", *(f"`{name}`" for name in PROFILES), "meaning")
    profiles = [
        (f"`{key}`", *(f"{getattr(profile, key):g}" for profile in PROFILES.values()), meaning)
        for key, meaning in _SCANNER.items()
    ]
    return "\n".join([*parts, _SCANNER_HEAD + _table(heads, profiles)])


def _table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [heads, ("---",) * len(heads), *rows]
    return "".join(f"| {' | '.join(row)} |\n" for row in lines)
