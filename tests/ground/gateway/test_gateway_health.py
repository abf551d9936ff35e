"""The sensors of SYS_STATUS: by telemetry and faults alone, and absent where nothing is known."""

import pytest

from ground.gateway.frames import mavlink as m
from ground.gateway.health import DEVICES, masks
from ground.gateway.vehicle_state import VehicleState
from protocol.tables.faults import BY_NAME
from protocol.tables.modes import Mode
from tests.ground.gateway_bed import ORIGIN, Bed, Client

GYRO, ACCEL = m.MAV_SYS_STATUS_SENSOR_3D_GYRO, m.MAV_SYS_STATUS_SENSOR_3D_ACCEL
LIDAR, MOTORS = m.MAV_SYS_STATUS_SENSOR_LASER_POSITION, m.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
BATTERY, POSE = m.MAV_SYS_STATUS_SENSOR_BATTERY, m.MAV_SYS_STATUS_AHRS
ALL = GYRO | ACCEL | LIDAR | MOTORS | BATTERY | POSE
FLYING = {"mode": 2.0, "faults": 0, "lidar_good": 40.0, "rate_1_radps": 0.0, "voltage_v": 25.0, "x_m": 1.0}
S = 1_000_000_000


def seen(onboard_ns=60 * S, **values):
    return VehicleState(FLYING | values, onboard_ns, False, ORIGIN)


def fault(*names):
    return sum(1 << BY_NAME[name].number for name in names)


def test_a_rover_that_is_well_has_all_of_them_present_enabled_and_healthy():
    assert masks(seen()) == (ALL, ALL, ALL)


@pytest.mark.parametrize(
    ("item", "bit"), [("lidar_good", LIDAR), ("rate_1_radps", MOTORS), ("voltage_v", BATTERY), ("x_m", POSE)]
)
def test_what_no_telemetry_shows_is_absent(item, bit):
    known = {name: value for name, value in FLYING.items() if name != item}
    for found in (masks(VehicleState(known, 60 * S, False, ORIGIN)), masks(seen(**{item: float("nan")}))):
        assert found == (ALL - bit,) * 3


def test_nothing_is_there_before_the_rover_has_told_its_faults():
    known = {name: value for name, value in FLYING.items() if name != "faults"}
    assert masks(VehicleState(known, 60 * S, False, ORIGIN)) == (0, 0, 0)


def test_a_scanner_that_gave_no_frame_yet_and_an_imu_in_the_first_second_are_not_known():
    assert masks(seen(lidar_good=0.0)).present == ALL - LIDAR
    assert masks(seen(S // 2)).present == ALL - GYRO - ACCEL


@pytest.mark.parametrize(
    ("name", "ill"),
    [
        ("LIDAR_SILENT", LIDAR),
        ("LIDAR_DIRTY", LIDAR),
        ("IMU_DEAD", GYRO | ACCEL),
        ("IMU_BIAS", GYRO),
        ("WHEEL_STUCK", MOTORS),
        ("STEER_OFFSET", MOTORS),
        ("POWER_LOW", BATTERY),
        ("POSE_UNSURE", POSE),
        ("CAN_BUS_OFF", GYRO | ACCEL | MOTORS),
        ("LOOP", 0),
        ("KEEP_OUT", 0),
    ],
)
def test_a_fault_makes_ill_what_it_is_of_and_takes_nothing_away(name, ill):
    assert masks(seen(faults=fault(name))) == (ALL, ALL, ALL & ~ill)


def test_bits_of_high_faults_are_read():
    assert masks(seen(faults=fault("IMU_BIAS", "TILT_STALL"))).healthy == ALL - GYRO


@pytest.mark.parametrize("mode", [Mode.ESTOP, Mode.BOOT])
def test_motors_are_not_enabled_where_a_mode_has_them_off(mode):
    assert masks(seen(mode=float(mode))) == (ALL, ALL - MOTORS, ALL)


def test_every_row_names_faults_of_the_table():
    assert all(name in BY_NAME for row in DEVICES for name in row.faults)


def test_a_client_is_told():
    bed = Bed()
    client = Client(bed)
    bed.step(3.0)
    told = client.heard("SYS_STATUS")[-1]
    assert told.onboard_control_sensors_present == GYRO | ACCEL | BATTERY | POSE
    assert told.onboard_control_sensors_health == told.onboard_control_sensors_enabled == GYRO | ACCEL | BATTERY | POSE
