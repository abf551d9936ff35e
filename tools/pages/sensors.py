"""Page docs/sensors.md: errors of the emulated sensors, from the tables in hil/devices."""

from __future__ import annotations

import dataclasses

from hil.devices.can.errors import USUAL
from hil.devices.lidar.errors import DEFAULT, SETS
from hil.devices.lidar.profile import PROFILES

_HEAD = """<!-- Made from hil/devices/can/errors.py, lidar_errors.py and lidar_profile.py by `make docs`. -->
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
`hil/devices/lidar/profile.py`, which names their sources. `hil lidar` has them as they are here; runs of the bench add
the losses of the next table.

"""
_LIDAR_HEAD = """## `[lidar]`

What the scanner of a run gets wrong, in a scenario's table or on the command line of `hil demo`, `hil sim`, `hil run`
and `hil lidar`. `profile` names the column that the other keys start from. Where neither file nor command line names
one, runs fly `{default}`.

```toml
[lidar]
profile = "utm-30lx"
lost_ratio = 0.03
dark_patches_m = [[4.0, 1.5, 0.5]]     # x, y, radius
```

    hil demo --lidar ideal
    hil run rough --lidar lost_ratio=0.03 --lidar clump_ratio=1

{table}
- **Lost at random**: single beams, and clumps of neighbours in a line; a clump is drawn again for each turn.
- **Grazing**: the light that comes back goes with the sine of the angle between beam and surface. From `grazing_rad` on
  the share of lost beams rises evenly with the sine, to all at half of it. Level ground under a scanner 0.7 m high is
  met at 5° at 8 m and at 2.5° at 16 m. The angle is that to the slope of the soil over two cells, a footprint, and on
  rocks to the sphere that they were cut from: a facet is not told apart. `hil lidar`, which has no field, takes the
  neighbours in the line instead: a surface flat to the beam across the line is not seen as flat there.
- **Dark**: a surface of albedo *a* is seen up to 30 m √*a*, whatever the angle; 0 returns nothing. Which rocks are dark
  follows from the seed. What a beam meets is decided by the place of its hit: in a rock's disc and above the soil, or
  in a patch.
- **Dirty window**: the sector is one of the scanner's own plane, 0 is straight ahead, so it turns with the rover:
  `--lidar window_ratio=0.9 --lidar window_from_rad=-0.3 --lidar window_to_rad=0.3`.
- **Sun**: the sector is one of the map, so it moves over the scanner as the rover turns; how high the sun stands is not
  modelled, and beams to the ground are lost like others.
- **Mixed pixels**: a beam that meets something farther than its neighbour by more than 0.2 m may tell a range between
  the two. Edges between one line and the next are not seen, nor edges before the sky.
- **Outliers, specks**: evenly spread up to the limit; a speck is in front of anything. On a sensor of several echoes
  the ground behind it comes as well.

Noise and these effects draw from generators of their own: to set one changes nothing of the other. `summary.json` tells
what was flown and lost ([demo.md](demo.md)). None of these ratios was measured on a real sensor: 1 %
lost beams, 5° and 10 % mixed pixels are guesses, and `python -m tests.scenarios losses` varies the lost share.
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
    """Return the text of the page."""
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
    return "\n".join([*parts, _SCANNER_HEAD + _table(heads, profiles), _lidar()])


def _lidar() -> str:
    heads = ("key", *(f"`{name}`" for name in SETS), "source and meaning")
    rows = [
        (f"`{each.name}`", *(_figure(getattr(errors, each.name)) for errors in SETS.values()), each.metadata["meaning"])
        for each in dataclasses.fields(DEFAULT)
    ]
    return _LIDAR_HEAD.format(default=DEFAULT.profile, table=_table(heads, rows))


def _figure(item: object) -> str:
    return f"{item:.4g}" if isinstance(item, float) else str(item) if item != () else "none"


def _table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [heads, ("---",) * len(heads), *rows]
    return "".join(f"| {' | '.join(row)} |\n" for row in lines)
