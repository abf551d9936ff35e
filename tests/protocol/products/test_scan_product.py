"""The scan product: stated errors, sizes, what damaged bytes do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError
from protocol.products.scan import ScanProduct, decode_scan, encode_scan

RANGE_OFF_M, TILT_OFF_RAD, TIME_OFF_NS = 0.001, 5.001e-6, 500
LINE_NS = 25_000_000


def room(lines=464, beams=521, noise_m=0.03, seed=1, hidden=0.18) -> ScanProduct:
    """A sweep over ground 0.7 m below the scanner, seen through noise, with statuses of no return in its sky."""
    generator = np.random.default_rng(seed)
    tilt = np.linspace(1.05, -0.35, lines)
    phi = np.linspace(-1.13, 1.13, beams)
    down = np.sin(tilt)[:, None] * np.cos(phi)[None, :]
    far = np.where(down > 0.02, 0.7 / np.maximum(down, 0.02), np.inf)
    status = np.where((far > 12.0) | (generator.random(far.shape) < hidden / 10), 1, 0).astype(np.uint8)
    ranges = np.where(status == 0, far + generator.normal(0, noise_m, far.shape), np.nan)
    ranges = np.rint(ranges * 1000) / 1000  # a scanner tells whole millimetres
    start_ns = 4_000_000_000 + LINE_NS * np.arange(lines, dtype=np.int64) + generator.integers(-9, 9, lines)
    tilt_ns = 3_900_000_000 + np.cumsum(generator.integers(4_900_000, 5_100_000, 5 * lines))
    return ScanProduct(
        3,
        -1.13,
        2.26 / max(1, beams - 1),
        ranges.astype(np.float32),
        status,
        start_ns,
        np.full(lines, 17361.1),
        tilt_ns,
        np.interp(tilt_ns, start_ns, tilt),
        np.diag([1.0, -1.0, -1.0, 1.0]),
        np.eye(4),
    )


def within_its_error(back: ScanProduct, sent: ScanProduct) -> bool:
    known = sent.status == 0
    off_m = np.abs(back.ranges_m.astype(np.float64) - sent.ranges_m)[known]
    return (
        np.array_equal(back.status, sent.status)
        and np.array_equal(np.isnan(back.ranges_m), ~known)
        and off_m.max(initial=0) <= RANGE_OFF_M
        and np.abs(back.tilt_rad - sent.tilt_rad).max(initial=0) <= TILT_OFF_RAD
        and np.abs(back.tilt_ns - sent.tilt_ns).max(initial=0) <= TIME_OFF_NS
        and np.abs(back.start_ns - sent.start_ns).max(initial=0) <= TIME_OFF_NS
    )


def exact(scan: ScanProduct) -> tuple:
    return (
        scan.stop,
        scan.first_angle_rad,
        scan.step_rad,
        scan.beam_ns.tolist(),
        scan.T_map_base.tolist(),
        scan.T_base_scanner.tolist(),
    )


def test_200_thousand_noisy_points_take_at_most_170_kb_at_1_mm():
    sent = room(550)
    data = encode_scan(sent)
    points = int((sent.status == 0).sum())
    assert points > 190_000
    assert len(data) <= 0.86 * points
    assert within_its_error(decode_scan(data), sent)


def test_what_is_no_range_comes_back_exactly():
    sent = room(40, 50)
    back = decode_scan(encode_scan(sent))
    assert exact(back) == exact(sent)


def test_packing_what_was_unpacked_gives_the_same_ranges_and_times_to_the_bit():
    once = decode_scan(encode_scan(room(40, 50)))
    twice = decode_scan(encode_scan(once))
    assert np.array_equal(once.ranges_m, twice.ranges_m, equal_nan=True)
    assert np.array_equal(once.tilt_ns, twice.tilt_ns) and np.array_equal(once.start_ns, twice.start_ns)
    assert np.array_equal(once.tilt_rad, twice.tilt_rad)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    st.integers(1, 9),
    st.integers(1, 9),
    st.integers(0, 12),
    st.floats(0, 1),
    st.integers(0, 2**16),
    st.sampled_from([0.01, 3.0, 60.0]),
)
def test_any_shape_mask_and_range_comes_back_within_the_stated_error(lines, beams, samples, share, seed, far_m):
    generator = np.random.default_rng(seed)
    status = (generator.random((lines, beams)) < share).astype(np.uint8) * generator.integers(1, 5)
    sent = ScanProduct(
        seed,
        0.1,
        0.2,
        np.where(status == 0, generator.uniform(0, far_m, status.shape), np.nan).astype(np.float32),
        status,
        generator.integers(0, 2**50, lines),
        generator.uniform(0, 1e5, lines),
        np.sort(generator.integers(0, 2**50, samples)),
        generator.uniform(-3, 3, samples),
        np.vstack([generator.normal(size=(3, 4)), [0, 0, 0, 1]]),
        np.eye(4),
    )
    back = decode_scan(encode_scan(sent))
    assert within_its_error(back, sent)
    assert exact(back) == exact(sent)


@pytest.mark.parametrize("wrong", [
    {"start_ns": np.zeros(3, np.int64)}, {"tilt_rad": np.zeros(1)}, {"status": np.zeros((2, 2), np.uint8)},
    {"ranges_m": np.full((8, 10), np.nan, np.float32)}, {"ranges_m": np.full((8, 10), 2e3, np.float32)},
])  # fmt: skip
def test_what_does_not_fit_together_is_our_own_error(wrong):
    with pytest.raises(ValueError, match=r"lines|axis|range"):
        encode_scan(room(8, 10, hidden=0.0)._replace(**wrong))


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.data())
def test_damaged_bytes_are_a_wire_error_or_a_scan_never_anything_else(data):
    whole = bytearray(encode_scan(room(12, 16)))
    at = data.draw(st.integers(0, len(whole) - 1))
    whole[at] ^= data.draw(st.integers(1, 255))
    cut = data.draw(st.integers(0, len(whole)))
    for bad in (bytes(whole), bytes(whole[:cut]), bytes(whole) + b"x"):
        try:
            decode_scan(bad)
        except WireError as error:
            assert error.kind == "product"


@given(st.binary(max_size=600))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_any_bytes_are_no_scan_or_a_clear_error(noise):
    for head in (b"", b"SCN1"):
        with pytest.raises(WireError):
            decode_scan(head + noise)
