"""The kernel that reads SCIP's blocks against the reader in steps over arrays, in every build."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.kernel_calls import scip as door
from onboard.native import variant
from protocol import WireError, scip
from tests.protocol.scip.test_scip_damage import DAMAGE, SHORT, damaged, scan_of


@pytest.fixture(params=variant.available())
def blocks(request, monkeypatch):
    monkeypatch.setattr(door, "kernels", variant.load(request.param))
    return door.Blocks


@pytest.mark.parametrize("beams", [1, 20, 21, 22, 42, 43, 64, 1081])
@pytest.mark.parametrize("code", ["MD", "ME", "MS"])
def test_kernel_and_reader_give_the_same_values(blocks, code, beams):
    asked = scip.ScanRequest(code, 0, beams - 1)
    frame = scan_of(asked, beams)[:-2]
    got = scip.ScanDecoder(asked, reader=blocks).decode(frame)
    want = scip.ScanDecoder(asked).decode(frame)
    assert np.array_equal(got.values, want.values) and got[:2] == want[:2]


@pytest.mark.parametrize("name", variant.available())
@settings(max_examples=200, deadline=None, derandomize=True)
@given(damage=DAMAGE)
def test_kernel_and_reader_take_the_same_frames(name, damage):
    frame = damaged(scan_of(SHORT, 1)[:-2], damage)
    at = len(scan_of(SHORT, 1).split(b"99b")[0]) + 10
    reader, kernel = scip.BlockReader(at, SHORT.values, 3), variant.load(name)
    values = np.empty(SHORT.values, np.int64)
    taken = kernel.scip_values_into(np.frombuffer(frame, np.uint8), at, 3, values)
    assert taken == reader(frame) and (not taken or np.array_equal(values, reader.values))


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.binary(max_size=400), st.integers(0, 500), st.integers(1, 120), st.integers(1, 10))
def test_any_bytes_are_taken_or_refused(data, at, count, characters):
    door.Blocks(at, count, characters)(data)


def test_no_single_flipped_bit_of_a_full_frame_is_taken_by_the_kernel(blocks):
    asked = scip.ScanRequest("MD", 0, 1080)
    frame, decoder = scan_of(asked, 3)[:-2], scip.ScanDecoder(asked, reader=blocks)
    read = blocks(26, asked.values, 3)
    assert read(frame)
    bad = bytearray(frame)
    for at in range(len(frame)):
        for bit in range(8):
            bad[at] ^= 1 << bit
            if at < 26:
                with pytest.raises(WireError):
                    decoder.decode(bytes(bad))
            else:
                assert not read(memoryview(bad))
            bad[at] ^= 1 << bit


@pytest.mark.parametrize("wrong", [(-1, 1, 3), (0, 0, 3), (0, 1, 0), (0, 1, 11)])
def test_the_door_refuses_layouts_that_cannot_be(wrong):
    with pytest.raises(ValueError, match="at, count, characters"):
        door.Blocks(*wrong)


@pytest.mark.parametrize("name", variant.available())
@pytest.mark.parametrize("each", [1, 2, 6])
def test_beams_are_metres_and_status_as_numpy_has_them(name, each, monkeypatch):
    monkeypatch.setattr(door, "kernels", variant.load(name))
    values = np.random.default_rng(each).integers(-1, 60, (200, each)) * np.array([1, 900] * 100)[:, None]
    status_of = np.array([3, 1, 2, 3, 4, 3, 0], np.uint8)
    ranges_m, status = np.empty(200, np.float32), np.empty(200, np.uint8)
    door.beams_into(values, each, status_of, ranges_m, status)
    want = status_of[values[:, 0].clip(0, 6)]
    metres = values[:, 0].astype(np.float32) * np.float32(1e-3)
    assert np.array_equal(status, want) and np.array_equal(ranges_m, np.where(want, np.nan, metres), equal_nan=True)


@pytest.mark.parametrize(("size", "each", "codes"), [(9, 1, 3), (10, 2, 3), (10, 1, 0), (0, 0, 3)])
def test_beams_of_another_size_are_refused(size, each, codes):
    with pytest.raises(ValueError, match="expected"):
        door.beams_into(
            np.zeros(size, np.int64), each, np.zeros(codes, np.uint8), np.empty(10, np.float32), np.empty(10, np.uint8)
        )
