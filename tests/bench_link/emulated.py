"""Rows `emulator` and `map`: the model of the link against its own profile, and the size of a map."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hil.link.impairment import OVERHEAD_BYTES, Impairment, Profile, both_directions
from hil.terrain.field import truth_height
from hil.terrain.fields import make_crater_field, make_field
from protocol.products import LdemProduct, MapGrid, decode_ldem, encode_ldem
from tests.bench_link.figures import Figure, Told, count, mean
from tests.bench_link.told import LINKS
from tests.bench_link.world import S, profile

RATE_RATIO, DELAY_S, SIGMAS = 0.01, 0.02, 3.0
SIZE_BYTES, ERROR_M = 26_000, 0.001
_CELLS = 200


def _rate_error(link: Profile, seconds: float) -> float:
    """Return the relative deviation of a saturated line's byte rate from its nominal rate."""
    model = both_directions(replace(link, loss=0.0, mean_bad_s=0.0, blackout_length_s=0.0, duplicate=0.0), 1)[0]
    size = 1150 if link.down_bps > 1e5 else 200
    spacing_ns = round((size + OVERHEAD_BYTES) * 8 * S / link.down_bps * 0.8)
    for now_ns in range(0, round(seconds * S), spacing_ns):
        model.offer(bytes(size), now_ns)
    begin_s = seconds / 6
    model.due(round(begin_s * S))
    bits = 8 * (size + OVERHEAD_BYTES) * len(model.due(round(seconds * S)))
    return abs(bits / (seconds - begin_s) / link.down_bps - 1)


def _delays_s(model: Impairment, link: Profile, rate_bps: float) -> list[float]:
    """Return each single datagram's deviation from the one-way delay and its time on the line, s."""
    off = []
    for k in range(2000):
        at_ns = k * S
        if model.offer(bytes(100), at_ns) == "":
            due_ns = model.next_due_ns
            assert due_ns is not None
            model.due(at_ns + round((link.one_way_s + 60) * S))
            flight_s = (due_ns - at_ns) / S - (100 + OVERHEAD_BYTES) * 8 / rate_bps
            off.append(abs(flight_s - link.one_way_s))
    return off


def _sigmas(link: Profile, seeds: int) -> float:
    """Return the deviation of the losses of 20,000 datagrams a seed from the profile, in sigmas, without shadow."""
    n, p = 20_000 * seeds, link.loss
    plain = replace(link, mean_bad_s=0.0, blackout_length_s=0.0)
    models = [model for seed in range(seeds) for model in both_directions(plain, seed)]
    lost = sum(model.offer(b"x", k * S) != "" for model in models for k in range(10_000))
    return abs(lost - n * p) / math.sqrt(n * p * (1 - p)) if p else float(lost)


def _shadow_sigmas(link: Profile, seeds: int) -> float:
    """Return the same for the share of time in shadow, with drawn stays: variance 2 T ab/(a+b) x share (1 - share)."""
    seconds, a, b = 20_000.0 * seeds, link.mean_bad_s, link.mean_good_s
    models, step_s = [both_directions(link, seed)[0] for seed in range(seeds)], 0.1
    steps = round(seconds / seeds / step_s)
    bad = sum(model.offer(b"x", round(k * step_s * S)) == "shadow" for model in models for k in range(steps))
    share = a / (a + b)
    sigma = math.sqrt(share * (1 - share) * 2 * (a * b / (a + b)) / seconds)
    return abs(bad * step_s / seconds - share) / sigma


def emulator(quick: bool, told: Told) -> list[Figure]:
    """Measure every profile: rate, delay, loss, and equal drops for equal seeds."""
    out, seeds = [], 1 if quick else 5
    for name in LINKS:
        told(name)
        link = profile(name)
        seconds = 3.0 if name == "lan" and quick else 60.0
        out.append(mean("emulator", name, "line rate off", [_rate_error(link, seconds)], RATE_RATIO))
        plain = replace(link, loss=0.0, mean_bad_s=0.0, blackout_length_s=0.0, reorder=0.0, duplicate=0.0)
        off = [
            _delays_s(model, plain, rate)
            for model, rate in zip(both_directions(plain, 1), (link.down_bps, link.up_bps))
        ]
        out.append(mean("emulator", name, "delay off", [max(max(one) for one in off)], DELAY_S, "s"))
        out.append(mean("emulator", name, "loss off", [_sigmas(link, seeds)], SIGMAS, "sigma"))
        if link.mean_bad_s:
            out.append(mean("emulator", name, "time in shadow off", [_shadow_sigmas(link, seeds)], SIGMAS, "sigma"))
        out.append(count("emulator", name, "drops that differ", _differing(link), 0, 6000))
    return out


def _differing(link: Profile) -> int:
    one, other = (both_directions(link, 7) for _ in range(2))
    first = [m.offer(bytes(80), k * 50_000_000) for k in range(3000) for m in one]
    second = [m.offer(bytes(80), k * 50_000_000) for k in range(3000) for m in other]
    return sum(a != b for a, b in zip(first, second))


def maps(quick: bool, told: Told) -> list[Figure]:
    """Measure 200 x 200 nodes of the bench's fields, at the map's own 5 cm and, rougher, every second node of them."""
    out, seeds = [], range(2 if quick else 12)
    for name, make, step in (("fBm", make_field, 1), ("fBm, 10 cm", make_field, 2), ("craters", make_crater_field, 1)):
        told(name)
        sizes, errors_m = [], []
        for seed in seeds:
            heights = np.ascontiguousarray(truth_height(make(seed))[::step, ::step][:_CELLS, :_CELLS])
            grid = MapGrid(0.0, 0.0, 0.05 * step, _CELLS, _CELLS)
            data = encode_ldem(LdemProduct(grid, heights, np.full((_CELLS, _CELLS), 3, np.uint8)))
            sizes.append(float(len(data)))
            errors_m.append(float(np.abs(decode_ldem(data).heights_m.astype(float) - heights).max()))
        out.append(mean("map", name, "200 x 200 nodes", sizes, SIZE_BYTES, "B"))
        out.append(mean("map", name, "height off", errors_m, ERROR_M, "m"))
    return out
