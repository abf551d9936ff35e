"""The tables of commands, modes and telemetry, and the dialect that carries them."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.core.telemetry import SAMPLERS
from protocol import WireError
from protocol.generated import eldorado_dialect
from protocol.link import events
from protocol.link.datagrams import payload_limit
from protocol.mavlink_frames import enu_angles, frd_from_flu, ned_angles, ned_from_enu
from protocol.tables import commands, modes, telemetry
from protocol.tables.arguments import ArgumentKind
from protocol.tables.modes import Mode, next_mode

ARGUMENTS = {row.name: commands.parse([*row.typed.split(), *row.example.split()])[1] for row in commands.TABLE}
ARGUMENTS["goto"] = {"x_m": 1.5, "y_m": -2.0, "heading_rad": 0.25}


# -- commands --------------------------------------------------------------------------------------------------


def test_command_ids_and_names_are_unique_and_fit_a_byte():
    assert len({r.id for r in commands.TABLE}) == len({r.name for r in commands.TABLE}) == len(commands.TABLE)
    assert all(0 < r.id < 256 for r in commands.TABLE)


@pytest.mark.parametrize("row", commands.TABLE, ids=lambda r: r.name)
def test_every_command_crosses_the_wire_unchanged(row):
    sent = commands.Telecommand(7, 11, 13, row.name, ARGUMENTS.get(row.name, {}))
    assert commands.decode(commands.encode(sent)) == sent
    for n in range(len(commands.encode(sent))):
        with pytest.raises(WireError):
            commands.decode(commands.encode(sent)[:n])


def longest(argument):
    text = max(argument.known, key=len) if argument.known else "x" * argument.most
    return {
        ArgumentKind.NUMBER: argument.high,
        ArgumentKind.CHOICE: (argument.choices or ("",))[-1],
        ArgumentKind.TEXT: text,
        ArgumentKind.POINTS: (argument.low, argument.high) * argument.most,
    }[argument.kind]


@pytest.mark.parametrize("row", commands.TABLE, ids=lambda r: r.name)
def test_the_longest_of_every_command_fits_a_datagram_of_the_slowest_profile(row):
    full = commands.Telecommand(7, 1 << 60, 1 << 60, row.name, {a.name: longest(a) for a in row.arguments}, 1 << 60)
    assert commands.decode(commands.encode(full)) == full
    assert len(commands.encode(full)) <= payload_limit(64_000)


@pytest.mark.parametrize("row", [r for r in commands.TABLE if r.arguments], ids=lambda r: r.name)
def test_what_is_out_of_bounds_is_refused_by_its_argument_and_name(row):
    for argument in row.arguments:
        bad = {
            ArgumentKind.NUMBER: argument.high + 1.0,
            ArgumentKind.CHOICE: "nothing",
            ArgumentKind.TEXT: "x" * (argument.most + 1),
            ArgumentKind.POINTS: (0.0, 0.0) * (argument.most + 1),
        }[argument.kind]
        with pytest.raises(ValueError, match=f"^{row.name}: `{argument.name}` = .* should be "):
            commands.check(row.name, {**ARGUMENTS[row.name], argument.name: bad})


@given(st.lists(st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)), min_size=1, max_size=16))
@settings(max_examples=50, deadline=None, derandomize=True)
def test_points_cross_the_wire_to_half_a_millimetre(points):
    flat = tuple(part for point in points for part in point)
    sent = commands.Telecommand(1, 0, 0, "mission", {"goals_m": flat})
    heard = commands.decode(commands.encode(sent)).arguments["goals_m"]
    assert np.allclose(heard, flat, rtol=0.0, atol=0.000501)
    assert commands.check("mission", {"goals_m": heard})["goals_m"] == heard


def test_what_a_person_types_is_read_by_the_row_angles_in_degrees():
    assert commands.parse(["faults", "mask", "NODE_LOST", "60"]) == (
        "faults_mask",
        {"fault": "NODE_LOST", "lasting_s": 60.0},
    )
    assert commands.parse(["emergency-stop"]) == ("emergency_stop", {})
    assert commands.parse(["drive", "0.1", "0", "-5", "20", "1"])[1]["yaw_radps"] == pytest.approx(-math.radians(5))
    assert commands.parse(["mission", "1", "2", "-3", "-4"])[1]["goals_m"] == (1.0, 2.0, -3.0, -4.0)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("faults", "unknown faults command ``; known: list, clear, mask"),
        ("faults musk X 60", "did you mean `mask`"),
        ("mission 1 2 3", "1 to 16 pairs"),
        ("turn 200", "turn: `heading_rad` = 200 degrees should be -180 to 180 degrees"),
        ("faults clear ENCODER_BED", "unknown fault `ENCODER_BED`; did you mean `ENCODER_BAD`?"),
        ("mission 4 0 8", "`goals_m` = 4 0 8, of which 8 is alone, should be 1 to 16 pairs"),
        ("stop now", "stop takes nothing, found now"),
    ],
)
def test_what_is_typed_wrong_is_named(line, words):
    with pytest.raises(ValueError) as caught:
        commands.parse(line.split())
    assert words in str(caught.value)


def test_a_command_that_changes_the_mode_is_allowed_exactly_where_its_transition_is():
    for row in commands.TABLE:
        begins = {t.state for t in modes.TRANSITIONS if t.event == row.name}
        if begins and row.name not in ("stop", "safe", "emergency_stop"):
            assert set(row.modes) == begins, row.name


def test_a_refusal_in_a_mode_says_what_it_needs_and_what_is_allowed_now():
    with pytest.raises(ValueError) as caught:
        commands.check_mode("goto", Mode.SAFE)
    assert str(caught.value).startswith("goto is refused in SAFE: it needs STANDBY, AUTONOMOUS; allowed now: resume, ")


def test_what_moves_the_rover_is_told_by_the_transitions():
    moves = {"goto", "mission", "return", "scan", "turn", "drive", "sequence_run"}
    assert {row.name for row in commands.TABLE if row.moves} == moves


def test_a_goto_without_heading_takes_53_bytes_and_comes_out_without():
    sent = commands.Telecommand(1, 0, 0, "goto", {"x_m": 1.0, "y_m": 2.0})
    assert len(commands.encode(sent)) == 29 + 24
    assert commands.decode(commands.encode(sent)).arguments == {"x_m": 1.0, "y_m": 2.0}


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("gote", {}, "unknown command `gote`; did you mean `goto`"),
        ("goto", {"x_m": 1}, "`y_m` is missing (-10000 to 10000 m)"),
        ("goto", {"x_m": 1, "y_m": 2, "z_m": 3}, "unknown argument `z_m`; takes x_m, y_m, heading_rad"),
        ("goto", {"x_m": 1, "y_m": math.nan}, "`y_m` = nan should be"),
        ("goto", {"x_m": True, "y_m": 1}, "`x_m` = True should be"),
        (
            "goto",
            {"x_m": 1, "y_m": 1, "heading_rad": 4},
            "`heading_rad` = 229.183 degrees should be -180 to 180 degrees",
        ),
        ("get", {"product": "moon"}, "`product` = 'moon' should be one of ldem"),
    ],
)
def test_what_is_wrong_is_named_with_what_is_allowed(name, arguments, words):
    with pytest.raises(ValueError) as caught:
        commands.check(name, arguments)
    assert words in str(caught.value)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.binary(max_size=60))
def test_noise_is_a_wire_error_or_a_telecommand_never_anything_else(noise):
    try:
        commands.decode(noise)
    except WireError as error:
        assert error.kind == "telecommand"


# -- modes -----------------------------------------------------------------------------------------------------


def test_the_transition_table_is_unambiguous_and_every_mode_can_be_reached_and_left():
    pairs = [(t.state, t.event) for t in modes.TRANSITIONS]
    assert len(set(pairs)) == len(pairs)
    assert {t.next for t in modes.TRANSITIONS} | {Mode.BOOT} == set(Mode) == {t.state for t in modes.TRANSITIONS}


@pytest.mark.parametrize("mode", [m for m in Mode if m != Mode.ESTOP])
def test_an_emergency_stop_is_taken_in_every_mode(mode):
    assert next_mode(mode, "emergency_stop") is Mode.ESTOP


def test_only_reset_leaves_the_emergency_stop():
    names = {t.event for t in modes.TRANSITIONS}
    assert [e for e in sorted(names) if next_mode(Mode.ESTOP, e)] == ["reset"]
    assert not [row.name for row in commands.TABLE if Mode.ESTOP in row.modes and row.moves]
    assert Mode.ESTOP in commands.command("reset").modes


def test_a_fault_leads_from_every_moving_or_waiting_mode_to_safe():
    for mode in set(Mode) - {Mode.SAFE, Mode.ESTOP}:
        assert next_mode(mode, "fault") is next_mode(mode, "safe") is Mode.SAFE
    assert next_mode(Mode.SAFE, "goto") is None


def test_every_mode_row_and_event_severity_is_known():
    assert [row.mode for row in modes.TABLE] == list(Mode)
    assert {row.severity for row in modes.EVENTS} <= set(modes.SEVERITIES)
    names = [row.name for row in modes.EVENTS]
    assert len(set(names)) == len(names) and all(len(n) <= 24 for n in names)


# -- telemetry -------------------------------------------------------------------------------------------------


def test_every_telemetry_item_has_one_number_one_name_and_one_sampler():
    assert len({r.id for r in telemetry.TABLE}) == len({r.name for r in telemetry.TABLE}) == len(telemetry.TABLE)
    assert set(SAMPLERS) == {r.name for r in telemetry.TABLE}
    assert all(0 < r.id < 65536 for r in telemetry.TABLE)


@pytest.mark.parametrize("row", [r for r in telemetry.TABLE if r.message], ids=lambda r: r.name)
def test_every_field_of_the_table_exists_in_the_dialect(row):
    kind = getattr(eldorado_dialect, f"MAVLink_{row.message.lower()}_message")
    assert row.field.partition("[")[0] in kind.fieldnames


def test_limits_mark_what_is_outside_and_what_is_not_a_number():
    assert not telemetry.out_of_limits("voltage_v", 25.0)
    assert telemetry.out_of_limits("voltage_v", 20.0)
    assert telemetry.out_of_limits("voltage_v", math.nan)
    assert not telemetry.out_of_limits("x_m", 1e9)


def test_the_dialect_is_what_its_xml_says():
    from tools.make_dialect import TARGET, generate

    assert TARGET.read_text() == generate(), "run python -m tools.make_dialect"


def test_the_common_messages_are_those_of_everybody():
    from pymavlink.dialects.v20 import common

    for name in ("heartbeat", "local_position_ned", "attitude", "sys_status", "statustext"):
        ours, theirs = (getattr(d, f"MAVLink_{name}_message") for d in (eldorado_dialect, common))
        assert (ours.id, ours.crc_extra, ours.fieldnames) == (theirs.id, theirs.crc_extra, theirs.fieldnames)


# -- frames ----------------------------------------------------------------------------------------------------


def test_a_point_3_east_4_north_5_up_is_4_north_3_east_5_up_in_ned():
    assert ned_from_enu(3.0, 4.0, 5.0) == (4.0, 3.0, -5.0)
    assert ned_from_enu(*ned_from_enu(3.0, 4.0, 5.0)) == (3.0, 4.0, 5.0)
    assert frd_from_flu(1.0, 2.0, 3.0) == (1.0, -2.0, -3.0)


@pytest.mark.parametrize(
    ("ours_deg", "theirs_deg"),
    [
        ((0, 0, 0), (0, 0, 90)),  # looking east
        ((0, 0, 90), (0, 0, 0)),  # north
        ((0, 0, 180), (0, 0, -90)),  # west
        ((0, 0, -90), (0, 0, 180)),  # south
        ((10, 20, 45), (10, -20, 45)),  # right side down, nose down, north-east
    ],
)
def test_headings_and_tilts_worked_by_hand(ours_deg, theirs_deg):
    ours = tuple(math.radians(a) for a in ours_deg)
    assert np.degrees(ned_angles(*ours)) == pytest.approx(theirs_deg)
    assert enu_angles(*ned_angles(*ours)) == pytest.approx(ours)


def rotation(roll, pitch, yaw):
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )


def test_the_angles_agree_with_the_matrices_of_both_frames():
    T_ned_enu, T_flu_frd = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]]), np.diag([1, -1, -1])
    for angles in itertools.product((-0.5, 0.2), (-0.7, 0.4), (-3.0, -1.0, 0.3, 2.5)):
        assert np.allclose(rotation(*ned_angles(*angles)), T_ned_enu @ rotation(*angles) @ T_flu_frd)


# -- events ----------------------------------------------------------------------------------------------------


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 2**16), st.sampled_from([0.0, 0.3, 0.6]))
def test_every_event_arrives_once_over_any_loss_and_all_are_acknowledged(seed, loss):
    generator, rover, ground, heard = np.random.default_rng(seed), events.EventSender(), events.EventReceiver(), []
    for n in range(30):
        rover.add(b"%d" % n, n)
    for now_ns in range(0, 3600 * 10**9, 10**9):
        for serial, frame in rover.due(now_ns):
            rover.sent(serial, now_ns)
            if generator.random() >= loss and ground.receive(serial):
                heard.append((serial, frame))
        for ack in ground.send(now_ns):
            if generator.random() >= loss:
                rover.acknowledge(ack)
        if not len(rover):
            break
    assert sorted(heard) == [(n + 1, b"%d" % n) for n in range(30)]
    assert len(rover) == 0


def test_over_512_waiting_events_the_oldest_is_dropped_and_the_ground_does_not_wait_for_it():
    rover, ground = events.EventSender(), events.EventReceiver()
    for n in range(600):
        rover.add(b"x", n)
    assert (len(rover), rover.dropped) == (512, 88)
    for serial, _ in rover.due(600):
        assert ground.receive(serial)
    rover.acknowledge(ground.send(10**9)[0])
    assert len(rover) == 0


@pytest.mark.parametrize("payload", [b"", b"abc", bytes(69)])
def test_a_malformed_acknowledgement_is_a_wire_error(payload):
    with pytest.raises(WireError):
        events.EventSender().acknowledge(payload)
