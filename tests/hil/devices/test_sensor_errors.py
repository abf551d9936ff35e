"""What the nodes get wrong is what the table says, and a scenario can change it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hil.devices.can.errors import USUAL, ImuErrors, PowerErrors, SensorErrors, TiltErrors, WheelErrors
from hil.devices.can.nodes import build_nodes
from hil.records import PlantState, WheelTruth
from hil.run.in_process import InMemory
from hil.scenarios.model import Scenario, load_scenario
from onboard.config import ConfigError
from onboard.records import Frame
from protocol.can.guard import Sender
from protocol.generated.can_codec import TABLE, TiltMode

TICK_NS = 10_000_000
ZERO = np.zeros(3)


def heard(errors, ticks, spin=lambda t_s: ZERO, force=(0.0, 0.0, 1.62), wheel=WheelTruth(0.2, 1.0, 0.5, 2.0)):  # noqa: B008
    """Decoded frames by name, of nodes with these errors."""
    nodes, frames = build_nodes(7, errors=errors), {}
    for k in range(1, ticks + 1):
        now_ns = k * TICK_NS
        nodes.step(
            now_ns,
            PlantState(
                now_ns,
                ZERO,
                np.array([0, 0, 0, 1.0]),
                ZERO,
                np.array(spin(now_ns / 1e9), float),
                np.array(force),
                (wheel,) * 4,
            ),
        )
        for frame in nodes.send():
            frames.setdefault(TABLE[frame.can_id].name, []).append(TABLE[frame.can_id].decode(frame.data))
    return frames


def spread(rows, name):
    return float(np.std([getattr(row, name) for row in rows]))


def test_wheels_pot_rate_and_current_scatter_as_the_table_says():
    frames = heard(SensorErrors(wheel=WheelErrors(0.004, 0.0, 0.03, 0.2)), 2000)
    feedback, status = frames["WHEEL_2_FEEDBACK"], frames["WHEEL_2_STATUS"]
    assert spread(feedback, "steer_rad") == pytest.approx(0.004, rel=0.1)
    assert spread(feedback, "rate_radps") == pytest.approx(0.03, rel=0.1)
    assert spread(status, "drive_current_a") == pytest.approx(0.2, rel=0.15)


def axes(rows):
    return np.array([row[:3] for row in rows])


def test_gyro_and_accelerometer_scatter_and_saturate_as_the_table_says():
    imu = ImuErrors(gyro_noise_radps=0.02, accel_noise_mps2=0.1, gyro_limit_radps=0.5, gyro_bias_radps=0.0)
    frames = heard(SensorErrors(imu=imu), 1000)
    assert axes(frames["IMU_GYRO"]).std(axis=0) == pytest.approx([0.02] * 3, rel=0.1)
    assert axes(frames["IMU_ACCEL"]).std(axis=0) == pytest.approx([0.1] * 3, rel=0.1)
    turning = heard(SensorErrors(imu=imu), 10, spin=lambda t_s: (0.0, 0.0, 2.0))["IMU_GYRO"]
    assert axes(turning)[:, 2] == pytest.approx([0.5] * 10, abs=1e-4) and {row.status for row in turning} == {1}


def test_a_bias_walks_by_its_step_a_sample():
    quiet = replace(USUAL.imu, gyro_noise_radps=0.0, gyro_bias_radps=0.0, gyro_walk_radps=0.001)
    way = axes(heard(SensorErrors(imu=quiet), 2000)["IMU_GYRO"])
    assert np.diff(way, axis=0).std() == pytest.approx(0.001, rel=0.1)


EXACT = ImuErrors(gyro_noise_radps=0.0, gyro_bias_radps=0.0, gyro_walk_radps=0.0, accel_noise_mps2=0.0,
                  accel_bias_mps2=0.0, accel_walk_mps2=0.0, scale_error_ratio=0.0)  # fmt: skip


def test_on_its_lever_the_imu_feels_the_turn_s_centripetal_and_tangential_pull():
    on_lever = SensorErrors(imu=replace(EXACT, lever_x_m=0.3, lever_y_m=0.1))
    steady = axes(heard(on_lever, 20, spin=lambda t_s: (0.0, 0.0, 0.8))["IMU_ACCEL"])
    assert steady[-1] == pytest.approx((-0.64 * 0.3, -0.64 * 0.1, 1.62), abs=2e-3)
    begun = axes(heard(on_lever, 20, spin=lambda t_s: (0.0, 0.0, 0.5 * t_s))["IMU_ACCEL"])
    assert begun[1] == pytest.approx((-0.5 * 0.1, 0.5 * 0.3, 1.62), abs=2e-3)
    at_base = axes(heard(SensorErrors(imu=EXACT), 20, spin=lambda t_s: (0.0, 0.0, 0.8))["IMU_ACCEL"])
    assert at_base[-1] == pytest.approx((0.0, 0.0, 1.62), abs=2e-3)


def swept(tilt):
    """Told and true tilt angles of a nod down and up, the true ones at the times of the told."""
    nodes, sender, told, true = build_nodes(3, errors=SensorErrors(tilt=tilt)), Sender(), [], []
    state = PlantState(0, ZERO, np.array([0, 0, 0, 1.0]), ZERO, ZERO, ZERO, (WheelTruth(0.0, 0.0, 0.0, 0.0),) * 4)

    def say(can_id, *values):
        nodes.receive(Frame(can_id, sender.encode(can_id, *values), now_ns), now_ns)

    for k in range(1, 500):
        now_ns = k * TICK_NS
        if k == 1:
            say(0x080, now_ns // 1000)
            say(0x120, 0.0, 0.4, 0.3, 300, TiltMode.SWEEP)
            say(0x120, 0.4, 0.0, 0.3, 300 + round(0.4 / 0.3 * 1000), TiltMode.SWEEP)
        nodes.step(now_ns, state)
        for frame in nodes.send():
            if frame.can_id == 0x1C0 and 700_000_000 < frame.stamp_ns < 2_800_000_000:
                told.append(TABLE[0x1C0].decode(frame.data).angle_rad)
                true.append(float(nodes.tilt.angles_at(np.array([frame.stamp_ns]))[0]))
    return np.array(told), np.array(true)


def test_backlash_leaves_the_scanner_behind_its_encoder_by_half_the_play_each_way():
    sound, loose = (swept(replace(TiltErrors(), encoder_step_rad=0.0, backlash_rad=play)) for play in (0.0, 0.02))
    assert sound[1].max() > 0.38
    off_rad = loose[0] - loose[1] - (sound[0] - sound[1])
    down, up = off_rad[: len(off_rad) // 3], off_rad[-len(off_rad) // 4 :]
    assert down == pytest.approx(np.full(len(down), 0.01), abs=2e-4)
    assert up == pytest.approx(np.full(len(up), -0.01), abs=2e-4)


def test_a_battery_under_its_brown_out_voltage_says_so_and_empties_by_what_is_taken():
    small = PowerErrors(capacity_j=2000.0, start_ratio=0.5, rest_w=100.0, current_noise_a=0.0, brown_out_v=24.0)
    rows = heard(SensorErrors(power=small), 800, wheel=WheelTruth(0.0, 0.0, 0.0, 0.0))["POWER_STATUS"]
    told = {(row.voltage_v < 24.0, bool(row.switches & 0x80)) for row in rows}
    assert told == {(False, False), (True, True)}
    assert rows[0].charge_ratio - rows[-1].charge_ratio == pytest.approx(100.0 * 7.8 / 2000.0, abs=0.02)


def write(folder, text):
    path = folder / "scenario.toml"
    path.write_text(f"seed = 1\n{text}")
    return path


def test_a_scenario_s_sensors_are_those_that_fly(tmp_path):
    scenario = load_scenario(write(tmp_path, 'terrain = "flat"\n[sensors.tilt]\nencoder_step_rad = 0.01\n'))
    flight = InMemory(scenario)
    assert flight.nodes.tilt.encoder_step_rad == 0.01
    flight.free()
    usual = InMemory(Scenario(terrain="flat"))
    assert usual.nodes.tilt.encoder_step_rad == math.tau / 4096
    usual.free()


@pytest.mark.parametrize(("text", "told"), [
    ("[sensors.imu]\ngyro_noise = 0.1\n", "did you mean `sensors.imu.gyro_noise_radps`"),
    ("[sensors.tilt]\nbacklash_rad = 3.0\n", "sensors.tilt.backlash_rad"),
    ("[sensors.nose]\nx = 1\n", "sensors.nose"),
])  # fmt: skip
def test_a_wrong_key_or_value_is_told_with_file_and_name(tmp_path, text, told):
    with pytest.raises(ConfigError, match=r"scenario\.toml.*" + told):
        load_scenario(write(tmp_path, text))
