"""A record runs again to the same bytes; one that was changed or cut is never called identical."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from hil.devices.nodes import build_nodes
from hil.records import PlantState, WheelTruth
from onboard.config import load
from onboard.core.tick import Rover, tick
from onboard.record.replay import DamagedRecordError, replay, replay_command
from onboard.record.writer import Recorder
from onboard.records import Inputs

TICKS = 300
STANDING = (WheelTruth(0.0, 0.0, 0.0, 0.0),) * 4
NAMED = re.compile(r"tick \d+, channel /\w+/\w+")


def standing(now_ns):
    zero = np.zeros(3)
    return PlantState(now_ns, zero, np.array([0, 0, 0, 1.0]), zero, zero, np.array([0.0, 0.0, 1.62]), STANDING)


def fly(path, change=lambda outputs: outputs):
    """Three seconds of standing: the nodes' frames in, the core's orders back to them, all of it recorded."""
    config = load(None, {"record.path": str(path)})
    rover, nodes = Rover(config, None), build_nodes(3)
    with Recorder(config, None) as recorder:
        for number in range(1, TICKS + 1):
            now_ns = number * 10_000_000
            nodes.step(now_ns, standing(now_ns))
            inputs = Inputs(number, now_ns, can_frames=tuple(nodes.send()))
            outputs = tick(rover, inputs)
            for frame in outputs.can_frames:
                nodes.receive(frame, now_ns)
            recorder.write(inputs, change(outputs))
    return path


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return fly(tmp_path_factory.mktemp("record") / "onboard.mcap")


def test_a_record_replays_to_the_same_bytes(record):
    verdict = replay(record)
    assert verdict.identical and verdict.first_difference == ""
    assert verdict.ticks == TICKS
    assert verdict.bytes_compared["/out/tick"] > 0 and verdict.bytes_compared["/out/can"] > 0


def test_the_same_run_gives_the_same_file(record):
    before = record.read_bytes()
    assert fly(record).read_bytes() == before


def test_an_output_that_the_core_would_not_make_is_named_by_tick_and_channel(tmp_path):
    def wrong(outputs):
        return replace(outputs, pose=(1e-9, *outputs.pose[1:]))

    verdict = replay(fly(tmp_path / "wrong.mcap", wrong))
    assert not verdict.identical
    assert verdict.first_difference.startswith("tick 1, channel /out/pose, byte 0: recorded ")
    assert replay_command(tmp_path / "wrong.mcap", as_json=False) == 1


def test_a_flipped_bit_anywhere_in_the_data_is_never_called_identical(record, tmp_path):
    whole = record.read_bytes()
    rng = np.random.default_rng(1)
    index = int.from_bytes(whole[-28:-20], "little")  # the footer's word of where the data ends and the index begins
    spread = rng.integers(0, index - 13, 60)  # before the 13 bytes of the data's end mark
    damaged = tmp_path / "damaged.mcap"
    for offset in spread.tolist():
        changed = bytearray(whole)
        changed[offset] ^= 1 << int(rng.integers(8))
        damaged.write_bytes(changed)
        try:
            verdict = replay(damaged)
        except DamagedRecordError as error:
            assert re.search(r"tick \d+|at its start", str(error)), offset
        else:
            assert not verdict.identical and NAMED.search(verdict.first_difference), offset


@pytest.mark.parametrize("kept_ratio", [0.0, 0.01, 0.3, 0.6, 0.9, 0.999])
def test_a_record_that_was_cut_off_is_reported_with_exit_65_and_one_line(record, tmp_path, capsys, kept_ratio):
    whole, cut = record.read_bytes(), tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(kept_ratio * len(whole))])
    with pytest.raises(DamagedRecordError, match=r"as far as tick \d+"):
        replay(cut)
    assert replay_command(cut, as_json=True) == 65
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and f"{cut} is damaged: " in err


def test_the_command_prints_the_verdict_and_exits_0(record, capsys):
    assert replay_command(record, as_json=True) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["verdict"], told["ticks"], told["first_difference"]) == ("identical", TICKS, "")
    assert replay_command(record, as_json=False) == 0
    assert capsys.readouterr().out.startswith(f"identical: {TICKS} ticks; bytes compared: /out/tick ")


def test_a_record_that_is_not_there_exits_66(tmp_path, capsys):
    assert replay_command(tmp_path / "none.mcap", as_json=False) == 66
    assert capsys.readouterr().err == f"onboard: no record {tmp_path / 'none.mcap'}\n"
