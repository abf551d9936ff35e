-- Made from protocol/ by tools/make_dissector.py: run `make codec`. Use: docs/dissector.md

-- Wireshark dissector for the MAVLink protocol (please see https://mavlink.io/en for details)

unknownFrameBeginOffset = 0
mavlink_proto = Proto("mavlink_proto", "MAVLink protocol")
f = mavlink_proto.fields

-- from http://lua-users.org/wiki/TimeZone
local function get_timezone()
    local now = os.time()
    return os.difftime(now, os.time(os.date("!*t", now)))
end
local signature_time_ref = get_timezone() + os.time{year=2015, month=1, day=1, hour=0}

-- threshold to decide if time is absolute or relative (some time in 2005)
time_usec_threshold = UInt64.new(0,0x40000)
-- function to append human-readable time onto unix_time_us fields
local function time_usec_decode(value)
    if value > time_usec_threshold then
        s = math.floor(value:tonumber() / 1000000.0)
        us = value % 1000000
        d = os.date("%Y-%m-%d %H:%M:%S",s)
        us = string.format("%06d",us:tonumber())
        ok, tz = pcall(os.date," %Z",s)
        if not ok then
            tz = os.date(" %z",s)
        end
        return " (" .. d .. "." .. us .. tz .. ")"
    elseif value < 1000000 then
        return ""
    elseif type(value) == "number" then
        return string.format(" (%.6f s)",value / 1000000.0)
    else
        return string.format(" (%.6f s)",value:tonumber() / 1000000.0)
    end
end

payload_fns = {}

protocolVersions = {
    [0xfd] = "MAVLink 2.0",
    [0xfe] = "MAVLink 1.0"
}

messageName = {
    [52001] = 'ROVER_STATE',
    [52002] = 'WHEELS',
    [52003] = 'ITEMS',
    [52004] = 'PROGRESS',
    [52005] = 'EVENT',
    [52010] = 'LINK_STATE',
    [1] = 'SYS_STATUS',
    [11] = 'SET_MODE',
    [20] = 'PARAM_REQUEST_READ',
    [21] = 'PARAM_REQUEST_LIST',
    [22] = 'PARAM_VALUE',
    [23] = 'PARAM_SET',
    [30] = 'ATTITUDE',
    [32] = 'LOCAL_POSITION_NED',
    [39] = 'MISSION_ITEM',
    [40] = 'MISSION_REQUEST',
    [41] = 'MISSION_SET_CURRENT',
    [42] = 'MISSION_CURRENT',
    [43] = 'MISSION_REQUEST_LIST',
    [44] = 'MISSION_COUNT',
    [45] = 'MISSION_CLEAR_ALL',
    [46] = 'MISSION_ITEM_REACHED',
    [47] = 'MISSION_ACK',
    [49] = 'GPS_GLOBAL_ORIGIN',
    [51] = 'MISSION_REQUEST_INT',
    [73] = 'MISSION_ITEM_INT',
    [74] = 'VFR_HUD',
    [75] = 'COMMAND_INT',
    [76] = 'COMMAND_LONG',
    [77] = 'COMMAND_ACK',
    [242] = 'HOME_POSITION',
    [253] = 'STATUSTEXT',
    [345] = 'PARAM_ERROR',
    [33] = 'GLOBAL_POSITION_INT',
    [148] = 'AUTOPILOT_VERSION',
    [0] = 'HEARTBEAT',
}

local enumEntryName = {
    ["MAV_GOTO"] = {
        [0] = "MAV_GOTO_DO_HOLD",
        [1] = "MAV_GOTO_DO_CONTINUE",
        [2] = "MAV_GOTO_HOLD_AT_CURRENT_POSITION",
        [3] = "MAV_GOTO_HOLD_AT_SPECIFIED_POSITION",
    },
    ["MAV_MODE"] = {
        [0] = "MAV_MODE_PREFLIGHT",
        [64] = "MAV_MODE_MANUAL_DISARMED",
        [66] = "MAV_MODE_TEST_DISARMED",
        [80] = "MAV_MODE_STABILIZE_DISARMED",
        [88] = "MAV_MODE_GUIDED_DISARMED",
        [92] = "MAV_MODE_AUTO_DISARMED",
        [192] = "MAV_MODE_MANUAL_ARMED",
        [194] = "MAV_MODE_TEST_ARMED",
        [208] = "MAV_MODE_STABILIZE_ARMED",
        [216] = "MAV_MODE_GUIDED_ARMED",
        [220] = "MAV_MODE_AUTO_ARMED",
    },
    ["MAV_SYS_STATUS_SENSOR"] = {
        [1] = "MAV_SYS_STATUS_SENSOR_3D_GYRO",
        [2] = "MAV_SYS_STATUS_SENSOR_3D_ACCEL",
        [4] = "MAV_SYS_STATUS_SENSOR_3D_MAG",
        [8] = "MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE",
        [16] = "MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE",
        [32] = "MAV_SYS_STATUS_SENSOR_GPS",
        [64] = "MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW",
        [128] = "MAV_SYS_STATUS_SENSOR_VISION_POSITION",
        [256] = "MAV_SYS_STATUS_SENSOR_LASER_POSITION",
        [512] = "MAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH",
        [1024] = "MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL",
        [2048] = "MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION",
        [4096] = "MAV_SYS_STATUS_SENSOR_YAW_POSITION",
        [8192] = "MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL",
        [16384] = "MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL",
        [32768] = "MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS",
        [65536] = "MAV_SYS_STATUS_SENSOR_RC_RECEIVER",
        [131072] = "MAV_SYS_STATUS_SENSOR_3D_GYRO2",
        [262144] = "MAV_SYS_STATUS_SENSOR_3D_ACCEL2",
        [524288] = "MAV_SYS_STATUS_SENSOR_3D_MAG2",
        [1048576] = "MAV_SYS_STATUS_GEOFENCE",
        [2097152] = "MAV_SYS_STATUS_AHRS",
        [4194304] = "MAV_SYS_STATUS_TERRAIN",
        [8388608] = "MAV_SYS_STATUS_REVERSE_MOTOR",
        [16777216] = "MAV_SYS_STATUS_LOGGING",
        [33554432] = "MAV_SYS_STATUS_SENSOR_BATTERY",
        [67108864] = "MAV_SYS_STATUS_SENSOR_PROXIMITY",
        [134217728] = "MAV_SYS_STATUS_SENSOR_SATCOM",
        [268435456] = "MAV_SYS_STATUS_PREARM_CHECK",
        [536870912] = "MAV_SYS_STATUS_OBSTACLE_AVOIDANCE",
        [1073741824] = "MAV_SYS_STATUS_SENSOR_PROPULSION",
        [2147483648] = "MAV_SYS_STATUS_EXTENSION_USED",
    },
    ["MAV_SYS_STATUS_SENSOR_EXTENDED"] = {
        [1] = "MAV_SYS_STATUS_RECOVERY_SYSTEM",
        [2] = "MAV_SYS_STATUS_SENSOR_LEAK",
    },
    ["MAV_FRAME"] = {
        [0] = "MAV_FRAME_GLOBAL",
        [1] = "MAV_FRAME_LOCAL_NED",
        [2] = "MAV_FRAME_MISSION",
        [3] = "MAV_FRAME_GLOBAL_RELATIVE_ALT",
        [4] = "MAV_FRAME_LOCAL_ENU",
        [5] = "MAV_FRAME_GLOBAL_INT",
        [6] = "MAV_FRAME_GLOBAL_RELATIVE_ALT_INT",
        [7] = "MAV_FRAME_LOCAL_OFFSET_NED",
        [8] = "MAV_FRAME_BODY_NED",
        [9] = "MAV_FRAME_BODY_OFFSET_NED",
        [10] = "MAV_FRAME_GLOBAL_TERRAIN_ALT",
        [11] = "MAV_FRAME_GLOBAL_TERRAIN_ALT_INT",
        [12] = "MAV_FRAME_BODY_FRD",
        [13] = "MAV_FRAME_RESERVED_13",
        [14] = "MAV_FRAME_RESERVED_14",
        [15] = "MAV_FRAME_RESERVED_15",
        [16] = "MAV_FRAME_RESERVED_16",
        [17] = "MAV_FRAME_RESERVED_17",
        [18] = "MAV_FRAME_RESERVED_18",
        [19] = "MAV_FRAME_RESERVED_19",
        [20] = "MAV_FRAME_LOCAL_FRD",
        [21] = "MAV_FRAME_LOCAL_FLU",
    },
    ["PREFLIGHT_STORAGE_PARAMETER_ACTION"] = {
        [0] = "PARAM_READ_PERSISTENT",
        [1] = "PARAM_WRITE_PERSISTENT",
        [2] = "PARAM_RESET_FACTORY_DEFAULT",
        [3] = "PARAM_RESET_SENSOR_DEFAULT",
        [4] = "PARAM_RESET_ALL_DEFAULT",
    },
    ["PREFLIGHT_STORAGE_MISSION_ACTION"] = {
        [0] = "MISSION_READ_PERSISTENT",
        [1] = "MISSION_WRITE_PERSISTENT",
        [2] = "MISSION_RESET_DEFAULT",
    },
    ["REBOOT_SHUTDOWN_ACTION"] = {
        [0] = "REBOOT_SHUTDOWN_ACTION_NONE",
        [1] = "REBOOT_SHUTDOWN_ACTION_REBOOT",
        [2] = "REBOOT_SHUTDOWN_ACTION_SHUTDOWN",
        [3] = "REBOOT_SHUTDOWN_ACTION_REBOOT_TO_BOOTLOADER",
        [4] = "REBOOT_SHUTDOWN_ACTION_POWER_ON",
        [5] = "REBOOT_SHUTDOWN_ACTION_REBOOT_TO_MASS_STORAGE",
    },
    ["REBOOT_SHUTDOWN_CONDITIONS"] = {
        [0] = "REBOOT_SHUTDOWN_CONDITIONS_SAFETY_INTERLOCKED",
        [20190226] = "REBOOT_SHUTDOWN_CONDITIONS_FORCE",
    },
    ["MAV_CMD"] = {
        [20] = "MAV_CMD_NAV_RETURN_TO_LAUNCH",
        [115] = "MAV_CMD_CONDITION_YAW",
        [176] = "MAV_CMD_DO_SET_MODE",
        [185] = "MAV_CMD_DO_FLIGHTTERMINATION",
        [192] = "MAV_CMD_DO_REPOSITION",
        [193] = "MAV_CMD_DO_PAUSE_CONTINUE",
        [245] = "MAV_CMD_PREFLIGHT_STORAGE",
        [246] = "MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN",
        [252] = "MAV_CMD_OVERRIDE_GOTO",
        [300] = "MAV_CMD_MISSION_START",
        [400] = "MAV_CMD_COMPONENT_ARM_DISARM",
        [410] = "MAV_CMD_GET_HOME_POSITION",
        [512] = "MAV_CMD_REQUEST_MESSAGE",
        [520] = "MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES",
        [31010] = "MAV_CMD_USER_1",
        [31011] = "MAV_CMD_USER_2",
    },
    ["MAV_PARAM_TYPE"] = {
        [1] = "MAV_PARAM_TYPE_UINT8",
        [2] = "MAV_PARAM_TYPE_INT8",
        [3] = "MAV_PARAM_TYPE_UINT16",
        [4] = "MAV_PARAM_TYPE_INT16",
        [5] = "MAV_PARAM_TYPE_UINT32",
        [6] = "MAV_PARAM_TYPE_INT32",
        [7] = "MAV_PARAM_TYPE_UINT64",
        [8] = "MAV_PARAM_TYPE_INT64",
        [9] = "MAV_PARAM_TYPE_REAL32",
        [10] = "MAV_PARAM_TYPE_REAL64",
    },
    ["MAV_PARAM_ERROR"] = {
        [0] = "MAV_PARAM_ERROR_NO_ERROR",
        [1] = "MAV_PARAM_ERROR_DOES_NOT_EXIST",
        [2] = "MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE",
        [3] = "MAV_PARAM_ERROR_PERMISSION_DENIED",
        [4] = "MAV_PARAM_ERROR_COMPONENT_NOT_FOUND",
        [5] = "MAV_PARAM_ERROR_READ_ONLY",
    },
    ["MAV_RESULT"] = {
        [0] = "MAV_RESULT_ACCEPTED",
        [1] = "MAV_RESULT_TEMPORARILY_REJECTED",
        [2] = "MAV_RESULT_DENIED",
        [3] = "MAV_RESULT_UNSUPPORTED",
        [4] = "MAV_RESULT_FAILED",
        [5] = "MAV_RESULT_IN_PROGRESS",
        [7] = "MAV_RESULT_COMMAND_LONG_ONLY",
        [8] = "MAV_RESULT_COMMAND_INT_ONLY",
    },
    ["MAV_MISSION_RESULT"] = {
        [0] = "MAV_MISSION_ACCEPTED",
        [1] = "MAV_MISSION_ERROR",
        [2] = "MAV_MISSION_UNSUPPORTED_FRAME",
        [3] = "MAV_MISSION_UNSUPPORTED",
        [4] = "MAV_MISSION_NO_SPACE",
        [5] = "MAV_MISSION_INVALID",
        [6] = "MAV_MISSION_INVALID_PARAM1",
        [7] = "MAV_MISSION_INVALID_PARAM2",
        [8] = "MAV_MISSION_INVALID_PARAM3",
        [9] = "MAV_MISSION_INVALID_PARAM4",
        [10] = "MAV_MISSION_INVALID_PARAM5_X",
        [11] = "MAV_MISSION_INVALID_PARAM6_Y",
        [12] = "MAV_MISSION_INVALID_PARAM7",
        [13] = "MAV_MISSION_INVALID_SEQUENCE",
        [14] = "MAV_MISSION_DENIED",
        [15] = "MAV_MISSION_OPERATION_CANCELLED",
    },
    ["MAV_SEVERITY"] = {
        [0] = "MAV_SEVERITY_EMERGENCY",
        [1] = "MAV_SEVERITY_ALERT",
        [2] = "MAV_SEVERITY_CRITICAL",
        [3] = "MAV_SEVERITY_ERROR",
        [4] = "MAV_SEVERITY_WARNING",
        [5] = "MAV_SEVERITY_NOTICE",
        [6] = "MAV_SEVERITY_INFO",
        [7] = "MAV_SEVERITY_DEBUG",
    },
    ["MAV_MISSION_TYPE"] = {
        [0] = "MAV_MISSION_TYPE_MISSION",
        [1] = "MAV_MISSION_TYPE_FENCE",
        [2] = "MAV_MISSION_TYPE_RALLY",
        [255] = "MAV_MISSION_TYPE_ALL",
    },
    ["MAV_DO_REPOSITION_FLAGS"] = {
        [1] = "MAV_DO_REPOSITION_FLAGS_CHANGE_MODE",
        [2] = "MAV_DO_REPOSITION_FLAGS_RELATIVE_YAW",
    },
    ["MISSION_STATE"] = {
        [0] = "MISSION_STATE_UNKNOWN",
        [1] = "MISSION_STATE_NO_MISSION",
        [2] = "MISSION_STATE_NOT_STARTED",
        [3] = "MISSION_STATE_ACTIVE",
        [4] = "MISSION_STATE_PAUSED",
        [5] = "MISSION_STATE_COMPLETE",
    },
    ["MAV_BOOL"] = {
        [0] = "MAV_BOOL_FALSE",
        [1] = "MAV_BOOL_TRUE",
    },
    ["MAV_PROTOCOL_CAPABILITY"] = {
        [1] = "MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT",
        [2] = "MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT",
        [4] = "MAV_PROTOCOL_CAPABILITY_MISSION_INT",
        [8] = "MAV_PROTOCOL_CAPABILITY_COMMAND_INT",
        [16] = "MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE",
        [32] = "MAV_PROTOCOL_CAPABILITY_FTP",
        [64] = "MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET",
        [128] = "MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED",
        [256] = "MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT",
        [512] = "MAV_PROTOCOL_CAPABILITY_TERRAIN",
        [1024] = "MAV_PROTOCOL_CAPABILITY_RESERVED3",
        [2048] = "MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION",
        [4096] = "MAV_PROTOCOL_CAPABILITY_COMPASS_CALIBRATION",
        [8192] = "MAV_PROTOCOL_CAPABILITY_MAVLINK2",
        [16384] = "MAV_PROTOCOL_CAPABILITY_MISSION_FENCE",
        [32768] = "MAV_PROTOCOL_CAPABILITY_MISSION_RALLY",
        [65536] = "MAV_PROTOCOL_CAPABILITY_RESERVED2",
        [131072] = "MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST",
        [262144] = "MAV_PROTOCOL_CAPABILITY_COMPONENT_IMPLEMENTS_GIMBAL_MANAGER",
        [524288] = "MAV_PROTOCOL_CAPABILITY_COMPONENT_ACCEPTS_GCS_CONTROL",
        [1048576] = "MAV_PROTOCOL_CAPABILITY_GRIPPER",
    },
    ["MAV_AUTOPILOT"] = {
        [0] = "MAV_AUTOPILOT_GENERIC",
        [1] = "MAV_AUTOPILOT_RESERVED",
        [2] = "MAV_AUTOPILOT_SLUGS",
        [3] = "MAV_AUTOPILOT_ARDUPILOTMEGA",
        [4] = "MAV_AUTOPILOT_OPENPILOT",
        [5] = "MAV_AUTOPILOT_GENERIC_WAYPOINTS_ONLY",
        [6] = "MAV_AUTOPILOT_GENERIC_WAYPOINTS_AND_SIMPLE_NAVIGATION_ONLY",
        [7] = "MAV_AUTOPILOT_GENERIC_MISSION_FULL",
        [8] = "MAV_AUTOPILOT_INVALID",
        [9] = "MAV_AUTOPILOT_PPZ",
        [10] = "MAV_AUTOPILOT_UDB",
        [11] = "MAV_AUTOPILOT_FP",
        [12] = "MAV_AUTOPILOT_PX4",
        [13] = "MAV_AUTOPILOT_SMACCMPILOT",
        [14] = "MAV_AUTOPILOT_AUTOQUAD",
        [15] = "MAV_AUTOPILOT_ARMAZILA",
        [16] = "MAV_AUTOPILOT_AEROB",
        [17] = "MAV_AUTOPILOT_ASLUAV",
        [18] = "MAV_AUTOPILOT_SMARTAP",
        [19] = "MAV_AUTOPILOT_AIRRAILS",
        [20] = "MAV_AUTOPILOT_REFLEX",
    },
    ["MAV_TYPE"] = {
        [0] = "MAV_TYPE_GENERIC",
        [1] = "MAV_TYPE_FIXED_WING",
        [2] = "MAV_TYPE_QUADROTOR",
        [3] = "MAV_TYPE_COAXIAL",
        [4] = "MAV_TYPE_HELICOPTER",
        [5] = "MAV_TYPE_ANTENNA_TRACKER",
        [6] = "MAV_TYPE_GCS",
        [7] = "MAV_TYPE_AIRSHIP",
        [8] = "MAV_TYPE_FREE_BALLOON",
        [9] = "MAV_TYPE_ROCKET",
        [10] = "MAV_TYPE_GROUND_ROVER",
        [11] = "MAV_TYPE_SURFACE_BOAT",
        [12] = "MAV_TYPE_SUBMARINE",
        [13] = "MAV_TYPE_HEXAROTOR",
        [14] = "MAV_TYPE_OCTOROTOR",
        [15] = "MAV_TYPE_TRICOPTER",
        [16] = "MAV_TYPE_FLAPPING_WING",
        [17] = "MAV_TYPE_KITE",
        [18] = "MAV_TYPE_ONBOARD_CONTROLLER",
        [19] = "MAV_TYPE_VTOL_DUOROTOR",
        [20] = "MAV_TYPE_VTOL_QUADROTOR",
        [21] = "MAV_TYPE_VTOL_TILTROTOR",
        [22] = "MAV_TYPE_VTOL_RESERVED2",
        [23] = "MAV_TYPE_VTOL_RESERVED3",
        [24] = "MAV_TYPE_VTOL_RESERVED4",
        [25] = "MAV_TYPE_VTOL_RESERVED5",
        [26] = "MAV_TYPE_GIMBAL",
        [27] = "MAV_TYPE_ADSB",
        [28] = "MAV_TYPE_PARAFOIL",
        [29] = "MAV_TYPE_DODECAROTOR",
        [30] = "MAV_TYPE_CAMERA",
        [31] = "MAV_TYPE_CHARGING_STATION",
        [32] = "MAV_TYPE_FLARM",
        [33] = "MAV_TYPE_SERVO",
        [34] = "MAV_TYPE_ODID",
        [35] = "MAV_TYPE_DECAROTOR",
        [36] = "MAV_TYPE_BATTERY",
        [37] = "MAV_TYPE_PARACHUTE",
        [38] = "MAV_TYPE_LOG",
        [39] = "MAV_TYPE_OSD",
        [40] = "MAV_TYPE_IMU",
        [41] = "MAV_TYPE_GPS",
        [42] = "MAV_TYPE_WINCH",
        [43] = "MAV_TYPE_GENERIC_MULTIROTOR",
        [44] = "MAV_TYPE_ILLUMINATOR",
        [45] = "MAV_TYPE_SPACECRAFT_ORBITER",
        [46] = "MAV_TYPE_GROUND_QUADRUPED",
        [47] = "MAV_TYPE_VTOL_GYRODYNE",
        [48] = "MAV_TYPE_GRIPPER",
    },
    ["MAV_MODE_FLAG"] = {
        [1] = "MAV_MODE_FLAG_CUSTOM_MODE_ENABLED",
        [2] = "MAV_MODE_FLAG_TEST_ENABLED",
        [4] = "MAV_MODE_FLAG_AUTO_ENABLED",
        [8] = "MAV_MODE_FLAG_GUIDED_ENABLED",
        [16] = "MAV_MODE_FLAG_STABILIZE_ENABLED",
        [32] = "MAV_MODE_FLAG_HIL_ENABLED",
        [64] = "MAV_MODE_FLAG_MANUAL_INPUT_ENABLED",
        [128] = "MAV_MODE_FLAG_SAFETY_ARMED",
    },
    ["MAV_STATE"] = {
        [0] = "MAV_STATE_UNINIT",
        [1] = "MAV_STATE_BOOT",
        [2] = "MAV_STATE_CALIBRATING",
        [3] = "MAV_STATE_STANDBY",
        [4] = "MAV_STATE_ACTIVE",
        [5] = "MAV_STATE_CRITICAL",
        [6] = "MAV_STATE_EMERGENCY",
        [7] = "MAV_STATE_POWEROFF",
        [8] = "MAV_STATE_FLIGHT_TERMINATION",
    },
}
f.magic = ProtoField.uint8("mavlink_proto.magic", "Magic value / version", base.HEX, protocolVersions)
f.length = ProtoField.uint8("mavlink_proto.length", "Payload length")
f.incompatibility_flag = ProtoField.uint8("mavlink_proto.incompatibility_flag", "Incompatibility flag", base.HEX_DEC)
f.compatibility_flag = ProtoField.uint8("mavlink_proto.compatibility_flag", "Compatibility flag", base.HEX_DEC)
f.sequence = ProtoField.uint8("mavlink_proto.sequence", "Packet sequence")
f.sysid = ProtoField.uint8("mavlink_proto.sysid", "System id", base.DEC)
f.compid = ProtoField.uint8("mavlink_proto.compid", "Component id", base.DEC, enumEntryName.MAV_COMPONENT)
f.msgid = ProtoField.uint24("mavlink_proto.msgid", "Message id", base.DEC, messageName)
f.payload = ProtoField.uint8("mavlink_proto.payload", "Payload", base.DEC, messageName)
f.crc = ProtoField.uint16("mavlink_proto.crc", "Message CRC", base.HEX)
f.signature_link = ProtoField.uint8("mavlink_proto.signature_link", "Link id", base.DEC)
f.signature_time = ProtoField.absolute_time("mavlink_proto.signature_time", "Time")
f.signature_signature = ProtoField.bytes("mavlink_proto.signature_signature", "Signature")
f.rawheader = ProtoField.bytes("mavlink_proto.rawheader", "Unparsable header fragment")
f.rawpayload = ProtoField.bytes("mavlink_proto.rawpayload", "Unparsable payload")

-- fields for FILE_TRANSFER_PROTOCOL.payload dissector
f.FILE_TRANSFER_PROTOCOL_payload_seq_number = ProtoField.uint16("mavlink_proto.FILE_TRANSFER_PROTOCOL_payload_seq_number", "seq_number")
f.FILE_TRANSFER_PROTOCOL_payload_session = ProtoField.uint8("mavlink_proto.FILE_TRANSFER_PROTOCOL_payload_session", "payload_session")
f.FILE_TRANSFER_PROTOCOL_payload_opcode = ProtoField.uint8("mavlink_proto.FILE_TRANSFER_PROTOCOL_payload_opcode", "opcode", base.DEC, enumEntryName.MAV_FTP_OPCODE)
f.FILE_TRANSFER_PROTOCOL_payload_size = ProtoField.uint8("mavlink_proto.FILE_TRANSFER_PROTOCOL_payload_size", "payload_size")
f.FILE_TRANSFER_PROTOCOL_payload_req_opcode = ProtoField.uint8("mavlink_proto.FILE_TRANSFER_PROTOCOL_payload_req_opcode", "req_opcode", base.DEC, enumEntryName.MAV_FTP_OPCODE)
f.FILE_TRANSFER_PROTOCOL_payload_burst_complete = ProtoField.uint8("mavlink_proto.FILE_TRANSFER_PROTOCOL_burst_complete", "burst_complete")
f.FILE_TRANSFER_PROTOCOL_payload_offset = ProtoField.int32("mavlink_proto.FILE_TRANSFER_PROTOCOL_payload_offset", "payload_offset")
f.FILE_TRANSFER_PROTOCOL_payload_data = ProtoField.bytes("mavlink_proto.FILE_TRANSFER_PROTOCOL_payload_data", "payload_data")


f.cmd_MAV_CMD_CONDITION_YAW_param1 = ProtoField.new("param1: Angle (float) deg", "mavlink_proto.cmd_MAV_CMD_CONDITION_YAW_param1", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_CONDITION_YAW_param2 = ProtoField.new("param2: Angular Speed (float) deg/s", "mavlink_proto.cmd_MAV_CMD_CONDITION_YAW_param2", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_CONDITION_YAW_param3 = ProtoField.new("param3: Direction (float)", "mavlink_proto.cmd_MAV_CMD_CONDITION_YAW_param3", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_CONDITION_YAW_param4 = ProtoField.new("param4: Relative (MAV_BOOL)", "mavlink_proto.cmd_MAV_CMD_CONDITION_YAW_param4", ftypes.UINT32, nil, base.HEX_DEC)
f.cmd_MAV_CMD_CONDITION_YAW_param4_flagMAV_BOOL_TRUE = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_CONDITION_YAW_param4.MAV_BOOL_TRUE", "MAV_BOOL_TRUE", 4, nil, 1)

f.cmd_MAV_CMD_DO_SET_MODE_param1 = ProtoField.new("param1: Mode (MAV_MODE_FLAG)", "mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param1", ftypes.UINT32, nil, base.HEX_DEC)
f.cmd_MAV_CMD_DO_SET_MODE_param1_flagMAV_MODE_FLAG_CUSTOM_MODE_ENABLED = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param1.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED", "MAV_MODE_FLAG_CUSTOM_MODE_ENABLED", 8, nil, 1)
f.cmd_MAV_CMD_DO_SET_MODE_param1_flagMAV_MODE_FLAG_TEST_ENABLED = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param1.MAV_MODE_FLAG_TEST_ENABLED", "MAV_MODE_FLAG_TEST_ENABLED", 8, nil, 2)
f.cmd_MAV_CMD_DO_SET_MODE_param1_flagMAV_MODE_FLAG_AUTO_ENABLED = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param1.MAV_MODE_FLAG_AUTO_ENABLED", "MAV_MODE_FLAG_AUTO_ENABLED", 8, nil, 4)
f.cmd_MAV_CMD_DO_SET_MODE_param1_flagMAV_MODE_FLAG_GUIDED_ENABLED = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param1.MAV_MODE_FLAG_GUIDED_ENABLED", "MAV_MODE_FLAG_GUIDED_ENABLED", 8, nil, 8)
f.cmd_MAV_CMD_DO_SET_MODE_param1_flagMAV_MODE_FLAG_STABILIZE_ENABLED = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param1.MAV_MODE_FLAG_STABILIZE_ENABLED", "MAV_MODE_FLAG_STABILIZE_ENABLED", 8, nil, 16)
f.cmd_MAV_CMD_DO_SET_MODE_param1_flagMAV_MODE_FLAG_HIL_ENABLED = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param1.MAV_MODE_FLAG_HIL_ENABLED", "MAV_MODE_FLAG_HIL_ENABLED", 8, nil, 32)
f.cmd_MAV_CMD_DO_SET_MODE_param1_flagMAV_MODE_FLAG_MANUAL_INPUT_ENABLED = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param1.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED", "MAV_MODE_FLAG_MANUAL_INPUT_ENABLED", 8, nil, 64)
f.cmd_MAV_CMD_DO_SET_MODE_param1_flagMAV_MODE_FLAG_SAFETY_ARMED = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param1.MAV_MODE_FLAG_SAFETY_ARMED", "MAV_MODE_FLAG_SAFETY_ARMED", 8, nil, 128)
f.cmd_MAV_CMD_DO_SET_MODE_param2 = ProtoField.new("param2: Custom Mode (float)", "mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param2", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_DO_SET_MODE_param3 = ProtoField.new("param3: Custom Submode (float)", "mavlink_proto.cmd_MAV_CMD_DO_SET_MODE_param3", ftypes.FLOAT, nil)

f.cmd_MAV_CMD_DO_FLIGHTTERMINATION_param1 = ProtoField.new("param1: Terminate (float)", "mavlink_proto.cmd_MAV_CMD_DO_FLIGHTTERMINATION_param1", ftypes.FLOAT, nil)

f.cmd_MAV_CMD_DO_REPOSITION_param1 = ProtoField.new("param1: Speed (float) m/s", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_param1", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_DO_REPOSITION_param2 = ProtoField.new("param2: Bitmask (MAV_DO_REPOSITION_FLAGS)", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_param2", ftypes.UINT32, nil, base.HEX_DEC)
f.cmd_MAV_CMD_DO_REPOSITION_param2_flagMAV_DO_REPOSITION_FLAGS_CHANGE_MODE = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_param2.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE", "MAV_DO_REPOSITION_FLAGS_CHANGE_MODE", 4, nil, 1)
f.cmd_MAV_CMD_DO_REPOSITION_param2_flagMAV_DO_REPOSITION_FLAGS_RELATIVE_YAW = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_param2.MAV_DO_REPOSITION_FLAGS_RELATIVE_YAW", "MAV_DO_REPOSITION_FLAGS_RELATIVE_YAW", 4, nil, 2)
f.cmd_MAV_CMD_DO_REPOSITION_param3 = ProtoField.new("param3: Radius (float) m", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_param3", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_DO_REPOSITION_param4 = ProtoField.new("param4: Yaw (float) rad", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_param4", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_DO_REPOSITION_param5 = ProtoField.new("param5: Latitude (float)", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_param5", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_DO_REPOSITION_x = ProtoField.new("x: Latitude (int32_t)", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_x", ftypes.INT32, nil)
f.cmd_MAV_CMD_DO_REPOSITION_param6 = ProtoField.new("param6: Longitude (float)", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_param6", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_DO_REPOSITION_y = ProtoField.new("y: Longitude (int32_t)", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_y", ftypes.INT32, nil)
f.cmd_MAV_CMD_DO_REPOSITION_param7 = ProtoField.new("param7: Altitude (float) m", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_param7", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_DO_REPOSITION_z = ProtoField.new("z: Altitude (float) m", "mavlink_proto.cmd_MAV_CMD_DO_REPOSITION_z", ftypes.FLOAT, nil)

f.cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1 = ProtoField.new("param1: Continue (MAV_BOOL)", "mavlink_proto.cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1", ftypes.UINT32, nil, base.HEX_DEC)
f.cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1_flagMAV_BOOL_TRUE = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1.MAV_BOOL_TRUE", "MAV_BOOL_TRUE", 4, nil, 1)

f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param1 = ProtoField.new("param1: Parameter Storage (PREFLIGHT_STORAGE_PARAMETER_ACTION)", "mavlink_proto.cmd_MAV_CMD_PREFLIGHT_STORAGE_param1", ftypes.UINT32, enumEntryName.PREFLIGHT_STORAGE_PARAMETER_ACTION)
f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param2 = ProtoField.new("param2: Mission Storage (PREFLIGHT_STORAGE_MISSION_ACTION)", "mavlink_proto.cmd_MAV_CMD_PREFLIGHT_STORAGE_param2", ftypes.UINT32, enumEntryName.PREFLIGHT_STORAGE_MISSION_ACTION)
f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param3 = ProtoField.new("param3: Logging Rate (float) Hz", "mavlink_proto.cmd_MAV_CMD_PREFLIGHT_STORAGE_param3", ftypes.FLOAT, nil)

f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param1 = ProtoField.new("param1: Autopilot (REBOOT_SHUTDOWN_ACTION)", "mavlink_proto.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param1", ftypes.UINT32, enumEntryName.REBOOT_SHUTDOWN_ACTION)
f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param2 = ProtoField.new("param2: Companion (REBOOT_SHUTDOWN_ACTION)", "mavlink_proto.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param2", ftypes.UINT32, enumEntryName.REBOOT_SHUTDOWN_ACTION)
f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param3 = ProtoField.new("param3: Component Action (REBOOT_SHUTDOWN_ACTION)", "mavlink_proto.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param3", ftypes.UINT32, enumEntryName.REBOOT_SHUTDOWN_ACTION)
f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param4 = ProtoField.new("param4: Component ID (float)", "mavlink_proto.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param4", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param6 = ProtoField.new("param6: Conditions (REBOOT_SHUTDOWN_CONDITIONS)", "mavlink_proto.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param6", ftypes.UINT32, enumEntryName.REBOOT_SHUTDOWN_CONDITIONS)
f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_y = ProtoField.new("y: Conditions (REBOOT_SHUTDOWN_CONDITIONS)", "mavlink_proto.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_y", ftypes.INT32, enumEntryName.REBOOT_SHUTDOWN_CONDITIONS)

f.cmd_MAV_CMD_OVERRIDE_GOTO_param1 = ProtoField.new("param1: Continue (MAV_GOTO)", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_param1", ftypes.UINT32, enumEntryName.MAV_GOTO)
f.cmd_MAV_CMD_OVERRIDE_GOTO_param2 = ProtoField.new("param2: Position (MAV_GOTO)", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_param2", ftypes.UINT32, enumEntryName.MAV_GOTO)
f.cmd_MAV_CMD_OVERRIDE_GOTO_param3 = ProtoField.new("param3: Frame (MAV_FRAME)", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_param3", ftypes.UINT32, enumEntryName.MAV_FRAME)
f.cmd_MAV_CMD_OVERRIDE_GOTO_param4 = ProtoField.new("param4: Yaw (float) deg", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_param4", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_OVERRIDE_GOTO_param5 = ProtoField.new("param5: Latitude/X (float)", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_param5", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_OVERRIDE_GOTO_x = ProtoField.new("x: Latitude/X (int32_t)", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_x", ftypes.INT32, nil)
f.cmd_MAV_CMD_OVERRIDE_GOTO_param6 = ProtoField.new("param6: Longitude/Y (float)", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_param6", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_OVERRIDE_GOTO_y = ProtoField.new("y: Longitude/Y (int32_t)", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_y", ftypes.INT32, nil)
f.cmd_MAV_CMD_OVERRIDE_GOTO_param7 = ProtoField.new("param7: Altitude/Z (float)", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_param7", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_OVERRIDE_GOTO_z = ProtoField.new("z: Altitude/Z (float)", "mavlink_proto.cmd_MAV_CMD_OVERRIDE_GOTO_z", ftypes.FLOAT, nil)

f.cmd_MAV_CMD_MISSION_START_param1 = ProtoField.new("param1: First Item (float)", "mavlink_proto.cmd_MAV_CMD_MISSION_START_param1", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_MISSION_START_param2 = ProtoField.new("param2: Last Item (float)", "mavlink_proto.cmd_MAV_CMD_MISSION_START_param2", ftypes.FLOAT, nil)

f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1 = ProtoField.new("param1: Arm (MAV_BOOL)", "mavlink_proto.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1", ftypes.UINT32, nil, base.HEX_DEC)
f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1_flagMAV_BOOL_TRUE = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1.MAV_BOOL_TRUE", "MAV_BOOL_TRUE", 4, nil, 1)
f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param2 = ProtoField.new("param2: Force (float)", "mavlink_proto.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param2", ftypes.FLOAT, nil)


f.cmd_MAV_CMD_REQUEST_MESSAGE_param1 = ProtoField.new("param1: Message ID (float)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_param1", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_REQUEST_MESSAGE_param2 = ProtoField.new("param2: Req Param 1 (float)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_param2", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_REQUEST_MESSAGE_param3 = ProtoField.new("param3: Req Param 2 (float)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_param3", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_REQUEST_MESSAGE_param4 = ProtoField.new("param4: Req Param 3 (float)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_param4", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_REQUEST_MESSAGE_param5 = ProtoField.new("param5: Req Param 4 (float)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_param5", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_REQUEST_MESSAGE_x = ProtoField.new("x: Req Param 4 (int32_t)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_x", ftypes.INT32, nil)
f.cmd_MAV_CMD_REQUEST_MESSAGE_param6 = ProtoField.new("param6: Req Param 5 (float)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_param6", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_REQUEST_MESSAGE_y = ProtoField.new("y: Req Param 5 (int32_t)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_y", ftypes.INT32, nil)
f.cmd_MAV_CMD_REQUEST_MESSAGE_param7 = ProtoField.new("param7: Response Target (float)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_param7", ftypes.FLOAT, nil)
f.cmd_MAV_CMD_REQUEST_MESSAGE_z = ProtoField.new("z: Response Target (float)", "mavlink_proto.cmd_MAV_CMD_REQUEST_MESSAGE_z", ftypes.FLOAT, nil)

f.cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1 = ProtoField.new("param1: Version (MAV_BOOL)", "mavlink_proto.cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1", ftypes.UINT32, nil, base.HEX_DEC)
f.cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1_flagMAV_BOOL_TRUE = ProtoField.bool("mavlink_proto.cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1.MAV_BOOL_TRUE", "MAV_BOOL_TRUE", 4, nil, 1)




f.ROVER_STATE_time_boot_ms = ProtoField.new("time_boot_ms (uint32_t) [ms]", "mavlink_proto.ROVER_STATE_time_boot_ms", ftypes.UINT32, nil)
f.ROVER_STATE_faults = ProtoField.new("faults (uint64_t)", "mavlink_proto.ROVER_STATE_faults", ftypes.UINT64, nil)
f.ROVER_STATE_goal_east = ProtoField.new("goal_east (float) [m]", "mavlink_proto.ROVER_STATE_goal_east", ftypes.FLOAT, nil)
f.ROVER_STATE_goal_north = ProtoField.new("goal_north (float) [m]", "mavlink_proto.ROVER_STATE_goal_north", ftypes.FLOAT, nil)
f.ROVER_STATE_distance = ProtoField.new("distance (float) [m]", "mavlink_proto.ROVER_STATE_distance", ftypes.FLOAT, nil)
f.ROVER_STATE_speed = ProtoField.new("speed (float) [m/s]", "mavlink_proto.ROVER_STATE_speed", ftypes.FLOAT, nil)
f.ROVER_STATE_sigma_position = ProtoField.new("sigma_position (float) [m]", "mavlink_proto.ROVER_STATE_sigma_position", ftypes.FLOAT, nil)
f.ROVER_STATE_sigma_yaw = ProtoField.new("sigma_yaw (float) [rad]", "mavlink_proto.ROVER_STATE_sigma_yaw", ftypes.FLOAT, nil)
f.ROVER_STATE_stop = ProtoField.new("stop (uint16_t)", "mavlink_proto.ROVER_STATE_stop", ftypes.UINT16, nil)
f.ROVER_STATE_mode = ProtoField.new("mode (uint8_t)", "mavlink_proto.ROVER_STATE_mode", ftypes.UINT8, nil)
f.ROVER_STATE_phase = ProtoField.new("phase (uint8_t)", "mavlink_proto.ROVER_STATE_phase", ftypes.UINT8, nil)

f.WHEELS_time_boot_ms = ProtoField.new("time_boot_ms (uint32_t) [ms]", "mavlink_proto.WHEELS_time_boot_ms", ftypes.UINT32, nil)
f.WHEELS_steer_0 = ProtoField.new("steer[0] (float) [rad]", "mavlink_proto.WHEELS_steer_0", ftypes.FLOAT, nil)
f.WHEELS_steer_1 = ProtoField.new("steer[1] (float) [rad]", "mavlink_proto.WHEELS_steer_1", ftypes.FLOAT, nil)
f.WHEELS_steer_2 = ProtoField.new("steer[2] (float) [rad]", "mavlink_proto.WHEELS_steer_2", ftypes.FLOAT, nil)
f.WHEELS_steer_3 = ProtoField.new("steer[3] (float) [rad]", "mavlink_proto.WHEELS_steer_3", ftypes.FLOAT, nil)
f.WHEELS_rate_0 = ProtoField.new("rate[0] (float) [rad/s]", "mavlink_proto.WHEELS_rate_0", ftypes.FLOAT, nil)
f.WHEELS_rate_1 = ProtoField.new("rate[1] (float) [rad/s]", "mavlink_proto.WHEELS_rate_1", ftypes.FLOAT, nil)
f.WHEELS_rate_2 = ProtoField.new("rate[2] (float) [rad/s]", "mavlink_proto.WHEELS_rate_2", ftypes.FLOAT, nil)
f.WHEELS_rate_3 = ProtoField.new("rate[3] (float) [rad/s]", "mavlink_proto.WHEELS_rate_3", ftypes.FLOAT, nil)
f.WHEELS_state_0 = ProtoField.new("state[0] (uint8_t)", "mavlink_proto.WHEELS_state_0", ftypes.UINT8, nil)
f.WHEELS_state_1 = ProtoField.new("state[1] (uint8_t)", "mavlink_proto.WHEELS_state_1", ftypes.UINT8, nil)
f.WHEELS_state_2 = ProtoField.new("state[2] (uint8_t)", "mavlink_proto.WHEELS_state_2", ftypes.UINT8, nil)
f.WHEELS_state_3 = ProtoField.new("state[3] (uint8_t)", "mavlink_proto.WHEELS_state_3", ftypes.UINT8, nil)

f.ITEMS_time_boot_ms = ProtoField.new("time_boot_ms (uint32_t) [ms]", "mavlink_proto.ITEMS_time_boot_ms", ftypes.UINT32, nil)
f.ITEMS_value_0 = ProtoField.new("value[0] (float)", "mavlink_proto.ITEMS_value_0", ftypes.FLOAT, nil)
f.ITEMS_value_1 = ProtoField.new("value[1] (float)", "mavlink_proto.ITEMS_value_1", ftypes.FLOAT, nil)
f.ITEMS_value_2 = ProtoField.new("value[2] (float)", "mavlink_proto.ITEMS_value_2", ftypes.FLOAT, nil)
f.ITEMS_value_3 = ProtoField.new("value[3] (float)", "mavlink_proto.ITEMS_value_3", ftypes.FLOAT, nil)
f.ITEMS_value_4 = ProtoField.new("value[4] (float)", "mavlink_proto.ITEMS_value_4", ftypes.FLOAT, nil)
f.ITEMS_value_5 = ProtoField.new("value[5] (float)", "mavlink_proto.ITEMS_value_5", ftypes.FLOAT, nil)
f.ITEMS_value_6 = ProtoField.new("value[6] (float)", "mavlink_proto.ITEMS_value_6", ftypes.FLOAT, nil)
f.ITEMS_value_7 = ProtoField.new("value[7] (float)", "mavlink_proto.ITEMS_value_7", ftypes.FLOAT, nil)
f.ITEMS_item_0 = ProtoField.new("item[0] (uint16_t)", "mavlink_proto.ITEMS_item_0", ftypes.UINT16, nil)
f.ITEMS_item_1 = ProtoField.new("item[1] (uint16_t)", "mavlink_proto.ITEMS_item_1", ftypes.UINT16, nil)
f.ITEMS_item_2 = ProtoField.new("item[2] (uint16_t)", "mavlink_proto.ITEMS_item_2", ftypes.UINT16, nil)
f.ITEMS_item_3 = ProtoField.new("item[3] (uint16_t)", "mavlink_proto.ITEMS_item_3", ftypes.UINT16, nil)
f.ITEMS_item_4 = ProtoField.new("item[4] (uint16_t)", "mavlink_proto.ITEMS_item_4", ftypes.UINT16, nil)
f.ITEMS_item_5 = ProtoField.new("item[5] (uint16_t)", "mavlink_proto.ITEMS_item_5", ftypes.UINT16, nil)
f.ITEMS_item_6 = ProtoField.new("item[6] (uint16_t)", "mavlink_proto.ITEMS_item_6", ftypes.UINT16, nil)
f.ITEMS_item_7 = ProtoField.new("item[7] (uint16_t)", "mavlink_proto.ITEMS_item_7", ftypes.UINT16, nil)

f.PROGRESS_time_boot_ms = ProtoField.new("time_boot_ms (uint32_t) [ms]", "mavlink_proto.PROGRESS_time_boot_ms", ftypes.UINT32, nil)
f.PROGRESS_ratio = ProtoField.new("ratio (float)", "mavlink_proto.PROGRESS_ratio", ftypes.FLOAT, nil)
f.PROGRESS_job = ProtoField.new("job (char)", "mavlink_proto.PROGRESS_job", ftypes.STRING, nil)

f.EVENT_time_boot_us = ProtoField.new("time_boot_us (uint64_t) [us]", "mavlink_proto.EVENT_time_boot_us", ftypes.UINT64, nil)
f.EVENT_serial = ProtoField.new("serial (uint32_t)", "mavlink_proto.EVENT_serial", ftypes.UINT32, nil)
f.EVENT_severity = ProtoField.new("severity (MAV_SEVERITY)", "mavlink_proto.EVENT_severity", ftypes.UINT8, enumEntryName.MAV_SEVERITY)
f.EVENT_name = ProtoField.new("name (char)", "mavlink_proto.EVENT_name", ftypes.STRING, nil)
f.EVENT_text = ProtoField.new("text (char)", "mavlink_proto.EVENT_text", ftypes.STRING, nil)

f.LINK_STATE_time_boot_ms = ProtoField.new("time_boot_ms (uint32_t) [ms]", "mavlink_proto.LINK_STATE_time_boot_ms", ftypes.UINT32, nil)
f.LINK_STATE_dictionary = ProtoField.new("dictionary (uint32_t)", "mavlink_proto.LINK_STATE_dictionary", ftypes.UINT32, nil)
f.LINK_STATE_dbc = ProtoField.new("dbc (uint32_t)", "mavlink_proto.LINK_STATE_dbc", ftypes.UINT32, nil)
f.LINK_STATE_dialect = ProtoField.new("dialect (uint32_t)", "mavlink_proto.LINK_STATE_dialect", ftypes.UINT32, nil)
f.LINK_STATE_lease = ProtoField.new("lease (uint8_t)", "mavlink_proto.LINK_STATE_lease", ftypes.UINT8, nil)
f.LINK_STATE_epoch = ProtoField.new("epoch (uint8_t)", "mavlink_proto.LINK_STATE_epoch", ftypes.UINT8, nil)

f.SYS_STATUS_onboard_control_sensors_present = ProtoField.new("onboard_control_sensors_present (MAV_SYS_STATUS_SENSOR)", "mavlink_proto.SYS_STATUS_onboard_control_sensors_present", ftypes.UINT32, nil, base.HEX_DEC)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_3D_GYRO = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_3D_GYRO", "MAV_SYS_STATUS_SENSOR_3D_GYRO", 32, nil, 1)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_3D_ACCEL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_3D_ACCEL", "MAV_SYS_STATUS_SENSOR_3D_ACCEL", 32, nil, 2)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_3D_MAG = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_3D_MAG", "MAV_SYS_STATUS_SENSOR_3D_MAG", 32, nil, 4)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE", "MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE", 32, nil, 8)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE", "MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE", 32, nil, 16)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_GPS = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_GPS", "MAV_SYS_STATUS_SENSOR_GPS", 32, nil, 32)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_OPTICAL_FLOW = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW", "MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW", 32, nil, 64)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_VISION_POSITION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_VISION_POSITION", "MAV_SYS_STATUS_SENSOR_VISION_POSITION", 32, nil, 128)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_LASER_POSITION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_LASER_POSITION", "MAV_SYS_STATUS_SENSOR_LASER_POSITION", 32, nil, 256)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH", "MAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH", 32, nil, 512)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL", "MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL", 32, nil, 1024)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION", "MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION", 32, nil, 2048)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_YAW_POSITION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_YAW_POSITION", "MAV_SYS_STATUS_SENSOR_YAW_POSITION", 32, nil, 4096)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL", "MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL", 32, nil, 8192)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL", "MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL", 32, nil, 16384)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS", "MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS", 32, nil, 32768)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_RC_RECEIVER = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_RC_RECEIVER", "MAV_SYS_STATUS_SENSOR_RC_RECEIVER", 32, nil, 65536)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_3D_GYRO2 = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_3D_GYRO2", "MAV_SYS_STATUS_SENSOR_3D_GYRO2", 32, nil, 131072)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_3D_ACCEL2 = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_3D_ACCEL2", "MAV_SYS_STATUS_SENSOR_3D_ACCEL2", 32, nil, 262144)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_3D_MAG2 = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_3D_MAG2", "MAV_SYS_STATUS_SENSOR_3D_MAG2", 32, nil, 524288)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_GEOFENCE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_GEOFENCE", "MAV_SYS_STATUS_GEOFENCE", 32, nil, 1048576)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_AHRS = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_AHRS", "MAV_SYS_STATUS_AHRS", 32, nil, 2097152)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_TERRAIN = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_TERRAIN", "MAV_SYS_STATUS_TERRAIN", 32, nil, 4194304)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_REVERSE_MOTOR = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_REVERSE_MOTOR", "MAV_SYS_STATUS_REVERSE_MOTOR", 32, nil, 8388608)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_LOGGING = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_LOGGING", "MAV_SYS_STATUS_LOGGING", 32, nil, 16777216)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_BATTERY = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_BATTERY", "MAV_SYS_STATUS_SENSOR_BATTERY", 32, nil, 33554432)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_PROXIMITY = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_PROXIMITY", "MAV_SYS_STATUS_SENSOR_PROXIMITY", 32, nil, 67108864)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_SATCOM = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_SATCOM", "MAV_SYS_STATUS_SENSOR_SATCOM", 32, nil, 134217728)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_PREARM_CHECK = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_PREARM_CHECK", "MAV_SYS_STATUS_PREARM_CHECK", 32, nil, 268435456)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_OBSTACLE_AVOIDANCE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_OBSTACLE_AVOIDANCE", "MAV_SYS_STATUS_OBSTACLE_AVOIDANCE", 32, nil, 536870912)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_SENSOR_PROPULSION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_SENSOR_PROPULSION", "MAV_SYS_STATUS_SENSOR_PROPULSION", 32, nil, 1073741824)
f.SYS_STATUS_onboard_control_sensors_present_flagMAV_SYS_STATUS_EXTENSION_USED = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present.MAV_SYS_STATUS_EXTENSION_USED", "MAV_SYS_STATUS_EXTENSION_USED", 32, nil, 2147483648)
f.SYS_STATUS_onboard_control_sensors_enabled = ProtoField.new("onboard_control_sensors_enabled (MAV_SYS_STATUS_SENSOR)", "mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled", ftypes.UINT32, nil, base.HEX_DEC)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_3D_GYRO = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_3D_GYRO", "MAV_SYS_STATUS_SENSOR_3D_GYRO", 32, nil, 1)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_3D_ACCEL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_3D_ACCEL", "MAV_SYS_STATUS_SENSOR_3D_ACCEL", 32, nil, 2)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_3D_MAG = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_3D_MAG", "MAV_SYS_STATUS_SENSOR_3D_MAG", 32, nil, 4)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE", "MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE", 32, nil, 8)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE", "MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE", 32, nil, 16)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_GPS = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_GPS", "MAV_SYS_STATUS_SENSOR_GPS", 32, nil, 32)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_OPTICAL_FLOW = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW", "MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW", 32, nil, 64)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_VISION_POSITION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_VISION_POSITION", "MAV_SYS_STATUS_SENSOR_VISION_POSITION", 32, nil, 128)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_LASER_POSITION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_LASER_POSITION", "MAV_SYS_STATUS_SENSOR_LASER_POSITION", 32, nil, 256)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH", "MAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH", 32, nil, 512)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL", "MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL", 32, nil, 1024)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION", "MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION", 32, nil, 2048)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_YAW_POSITION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_YAW_POSITION", "MAV_SYS_STATUS_SENSOR_YAW_POSITION", 32, nil, 4096)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL", "MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL", 32, nil, 8192)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL", "MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL", 32, nil, 16384)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS", "MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS", 32, nil, 32768)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_RC_RECEIVER = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_RC_RECEIVER", "MAV_SYS_STATUS_SENSOR_RC_RECEIVER", 32, nil, 65536)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_3D_GYRO2 = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_3D_GYRO2", "MAV_SYS_STATUS_SENSOR_3D_GYRO2", 32, nil, 131072)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_3D_ACCEL2 = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_3D_ACCEL2", "MAV_SYS_STATUS_SENSOR_3D_ACCEL2", 32, nil, 262144)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_3D_MAG2 = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_3D_MAG2", "MAV_SYS_STATUS_SENSOR_3D_MAG2", 32, nil, 524288)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_GEOFENCE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_GEOFENCE", "MAV_SYS_STATUS_GEOFENCE", 32, nil, 1048576)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_AHRS = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_AHRS", "MAV_SYS_STATUS_AHRS", 32, nil, 2097152)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_TERRAIN = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_TERRAIN", "MAV_SYS_STATUS_TERRAIN", 32, nil, 4194304)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_REVERSE_MOTOR = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_REVERSE_MOTOR", "MAV_SYS_STATUS_REVERSE_MOTOR", 32, nil, 8388608)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_LOGGING = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_LOGGING", "MAV_SYS_STATUS_LOGGING", 32, nil, 16777216)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_BATTERY = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_BATTERY", "MAV_SYS_STATUS_SENSOR_BATTERY", 32, nil, 33554432)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_PROXIMITY = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_PROXIMITY", "MAV_SYS_STATUS_SENSOR_PROXIMITY", 32, nil, 67108864)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_SATCOM = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_SATCOM", "MAV_SYS_STATUS_SENSOR_SATCOM", 32, nil, 134217728)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_PREARM_CHECK = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_PREARM_CHECK", "MAV_SYS_STATUS_PREARM_CHECK", 32, nil, 268435456)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_OBSTACLE_AVOIDANCE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_OBSTACLE_AVOIDANCE", "MAV_SYS_STATUS_OBSTACLE_AVOIDANCE", 32, nil, 536870912)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_SENSOR_PROPULSION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_SENSOR_PROPULSION", "MAV_SYS_STATUS_SENSOR_PROPULSION", 32, nil, 1073741824)
f.SYS_STATUS_onboard_control_sensors_enabled_flagMAV_SYS_STATUS_EXTENSION_USED = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled.MAV_SYS_STATUS_EXTENSION_USED", "MAV_SYS_STATUS_EXTENSION_USED", 32, nil, 2147483648)
f.SYS_STATUS_onboard_control_sensors_health = ProtoField.new("onboard_control_sensors_health (MAV_SYS_STATUS_SENSOR)", "mavlink_proto.SYS_STATUS_onboard_control_sensors_health", ftypes.UINT32, nil, base.HEX_DEC)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_3D_GYRO = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_3D_GYRO", "MAV_SYS_STATUS_SENSOR_3D_GYRO", 32, nil, 1)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_3D_ACCEL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_3D_ACCEL", "MAV_SYS_STATUS_SENSOR_3D_ACCEL", 32, nil, 2)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_3D_MAG = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_3D_MAG", "MAV_SYS_STATUS_SENSOR_3D_MAG", 32, nil, 4)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE", "MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE", 32, nil, 8)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE", "MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE", 32, nil, 16)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_GPS = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_GPS", "MAV_SYS_STATUS_SENSOR_GPS", 32, nil, 32)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_OPTICAL_FLOW = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW", "MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW", 32, nil, 64)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_VISION_POSITION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_VISION_POSITION", "MAV_SYS_STATUS_SENSOR_VISION_POSITION", 32, nil, 128)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_LASER_POSITION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_LASER_POSITION", "MAV_SYS_STATUS_SENSOR_LASER_POSITION", 32, nil, 256)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH", "MAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH", 32, nil, 512)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL", "MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL", 32, nil, 1024)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION", "MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION", 32, nil, 2048)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_YAW_POSITION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_YAW_POSITION", "MAV_SYS_STATUS_SENSOR_YAW_POSITION", 32, nil, 4096)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL", "MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL", 32, nil, 8192)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL", "MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL", 32, nil, 16384)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS", "MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS", 32, nil, 32768)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_RC_RECEIVER = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_RC_RECEIVER", "MAV_SYS_STATUS_SENSOR_RC_RECEIVER", 32, nil, 65536)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_3D_GYRO2 = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_3D_GYRO2", "MAV_SYS_STATUS_SENSOR_3D_GYRO2", 32, nil, 131072)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_3D_ACCEL2 = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_3D_ACCEL2", "MAV_SYS_STATUS_SENSOR_3D_ACCEL2", 32, nil, 262144)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_3D_MAG2 = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_3D_MAG2", "MAV_SYS_STATUS_SENSOR_3D_MAG2", 32, nil, 524288)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_GEOFENCE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_GEOFENCE", "MAV_SYS_STATUS_GEOFENCE", 32, nil, 1048576)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_AHRS = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_AHRS", "MAV_SYS_STATUS_AHRS", 32, nil, 2097152)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_TERRAIN = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_TERRAIN", "MAV_SYS_STATUS_TERRAIN", 32, nil, 4194304)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_REVERSE_MOTOR = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_REVERSE_MOTOR", "MAV_SYS_STATUS_REVERSE_MOTOR", 32, nil, 8388608)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_LOGGING = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_LOGGING", "MAV_SYS_STATUS_LOGGING", 32, nil, 16777216)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_BATTERY = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_BATTERY", "MAV_SYS_STATUS_SENSOR_BATTERY", 32, nil, 33554432)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_PROXIMITY = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_PROXIMITY", "MAV_SYS_STATUS_SENSOR_PROXIMITY", 32, nil, 67108864)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_SATCOM = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_SATCOM", "MAV_SYS_STATUS_SENSOR_SATCOM", 32, nil, 134217728)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_PREARM_CHECK = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_PREARM_CHECK", "MAV_SYS_STATUS_PREARM_CHECK", 32, nil, 268435456)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_OBSTACLE_AVOIDANCE = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_OBSTACLE_AVOIDANCE", "MAV_SYS_STATUS_OBSTACLE_AVOIDANCE", 32, nil, 536870912)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_SENSOR_PROPULSION = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_SENSOR_PROPULSION", "MAV_SYS_STATUS_SENSOR_PROPULSION", 32, nil, 1073741824)
f.SYS_STATUS_onboard_control_sensors_health_flagMAV_SYS_STATUS_EXTENSION_USED = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health.MAV_SYS_STATUS_EXTENSION_USED", "MAV_SYS_STATUS_EXTENSION_USED", 32, nil, 2147483648)
f.SYS_STATUS_load = ProtoField.new("load (uint16_t) [d%]", "mavlink_proto.SYS_STATUS_load", ftypes.UINT16, nil)
f.SYS_STATUS_voltage_battery = ProtoField.new("voltage_battery (uint16_t) [mV]", "mavlink_proto.SYS_STATUS_voltage_battery", ftypes.UINT16, nil)
f.SYS_STATUS_current_battery = ProtoField.new("current_battery (int16_t) [cA]", "mavlink_proto.SYS_STATUS_current_battery", ftypes.INT16, nil)
f.SYS_STATUS_battery_remaining = ProtoField.new("battery_remaining (int8_t) [%]", "mavlink_proto.SYS_STATUS_battery_remaining", ftypes.INT8, nil)
f.SYS_STATUS_drop_rate_comm = ProtoField.new("drop_rate_comm (uint16_t) [c%]", "mavlink_proto.SYS_STATUS_drop_rate_comm", ftypes.UINT16, nil)
f.SYS_STATUS_errors_comm = ProtoField.new("errors_comm (uint16_t)", "mavlink_proto.SYS_STATUS_errors_comm", ftypes.UINT16, nil)
f.SYS_STATUS_errors_count1 = ProtoField.new("errors_count1 (uint16_t)", "mavlink_proto.SYS_STATUS_errors_count1", ftypes.UINT16, nil)
f.SYS_STATUS_errors_count2 = ProtoField.new("errors_count2 (uint16_t)", "mavlink_proto.SYS_STATUS_errors_count2", ftypes.UINT16, nil)
f.SYS_STATUS_errors_count3 = ProtoField.new("errors_count3 (uint16_t)", "mavlink_proto.SYS_STATUS_errors_count3", ftypes.UINT16, nil)
f.SYS_STATUS_errors_count4 = ProtoField.new("errors_count4 (uint16_t)", "mavlink_proto.SYS_STATUS_errors_count4", ftypes.UINT16, nil)
f.SYS_STATUS_onboard_control_sensors_present_extended = ProtoField.new("onboard_control_sensors_present_extended (MAV_SYS_STATUS_SENSOR_EXTENDED)", "mavlink_proto.SYS_STATUS_onboard_control_sensors_present_extended", ftypes.UINT32, nil, base.HEX_DEC)
f.SYS_STATUS_onboard_control_sensors_present_extended_flagMAV_SYS_STATUS_RECOVERY_SYSTEM = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present_extended.MAV_SYS_STATUS_RECOVERY_SYSTEM", "MAV_SYS_STATUS_RECOVERY_SYSTEM", 4, nil, 1)
f.SYS_STATUS_onboard_control_sensors_present_extended_flagMAV_SYS_STATUS_SENSOR_LEAK = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_present_extended.MAV_SYS_STATUS_SENSOR_LEAK", "MAV_SYS_STATUS_SENSOR_LEAK", 4, nil, 2)
f.SYS_STATUS_onboard_control_sensors_enabled_extended = ProtoField.new("onboard_control_sensors_enabled_extended (MAV_SYS_STATUS_SENSOR_EXTENDED)", "mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled_extended", ftypes.UINT32, nil, base.HEX_DEC)
f.SYS_STATUS_onboard_control_sensors_enabled_extended_flagMAV_SYS_STATUS_RECOVERY_SYSTEM = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled_extended.MAV_SYS_STATUS_RECOVERY_SYSTEM", "MAV_SYS_STATUS_RECOVERY_SYSTEM", 4, nil, 1)
f.SYS_STATUS_onboard_control_sensors_enabled_extended_flagMAV_SYS_STATUS_SENSOR_LEAK = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_enabled_extended.MAV_SYS_STATUS_SENSOR_LEAK", "MAV_SYS_STATUS_SENSOR_LEAK", 4, nil, 2)
f.SYS_STATUS_onboard_control_sensors_health_extended = ProtoField.new("onboard_control_sensors_health_extended (MAV_SYS_STATUS_SENSOR_EXTENDED)", "mavlink_proto.SYS_STATUS_onboard_control_sensors_health_extended", ftypes.UINT32, nil, base.HEX_DEC)
f.SYS_STATUS_onboard_control_sensors_health_extended_flagMAV_SYS_STATUS_RECOVERY_SYSTEM = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health_extended.MAV_SYS_STATUS_RECOVERY_SYSTEM", "MAV_SYS_STATUS_RECOVERY_SYSTEM", 4, nil, 1)
f.SYS_STATUS_onboard_control_sensors_health_extended_flagMAV_SYS_STATUS_SENSOR_LEAK = ProtoField.bool("mavlink_proto.SYS_STATUS_onboard_control_sensors_health_extended.MAV_SYS_STATUS_SENSOR_LEAK", "MAV_SYS_STATUS_SENSOR_LEAK", 4, nil, 2)

f.SET_MODE_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.SET_MODE_target_system", ftypes.UINT8, nil)
f.SET_MODE_base_mode = ProtoField.new("base_mode (MAV_MODE)", "mavlink_proto.SET_MODE_base_mode", ftypes.UINT8, enumEntryName.MAV_MODE)
f.SET_MODE_custom_mode = ProtoField.new("custom_mode (uint32_t)", "mavlink_proto.SET_MODE_custom_mode", ftypes.UINT32, nil)

f.PARAM_REQUEST_READ_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.PARAM_REQUEST_READ_target_system", ftypes.UINT8, nil)
f.PARAM_REQUEST_READ_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.PARAM_REQUEST_READ_target_component", ftypes.UINT8, nil)
f.PARAM_REQUEST_READ_param_id = ProtoField.new("param_id (char)", "mavlink_proto.PARAM_REQUEST_READ_param_id", ftypes.STRING, nil)
f.PARAM_REQUEST_READ_param_index = ProtoField.new("param_index (int16_t)", "mavlink_proto.PARAM_REQUEST_READ_param_index", ftypes.INT16, nil)

f.PARAM_REQUEST_LIST_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.PARAM_REQUEST_LIST_target_system", ftypes.UINT8, nil)
f.PARAM_REQUEST_LIST_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.PARAM_REQUEST_LIST_target_component", ftypes.UINT8, nil)

f.PARAM_VALUE_param_id = ProtoField.new("param_id (char)", "mavlink_proto.PARAM_VALUE_param_id", ftypes.STRING, nil)
f.PARAM_VALUE_param_value = ProtoField.new("param_value (float)", "mavlink_proto.PARAM_VALUE_param_value", ftypes.FLOAT, nil)
f.PARAM_VALUE_param_type = ProtoField.new("param_type (MAV_PARAM_TYPE)", "mavlink_proto.PARAM_VALUE_param_type", ftypes.UINT8, enumEntryName.MAV_PARAM_TYPE)
f.PARAM_VALUE_param_count = ProtoField.new("param_count (uint16_t)", "mavlink_proto.PARAM_VALUE_param_count", ftypes.UINT16, nil)
f.PARAM_VALUE_param_index = ProtoField.new("param_index (uint16_t)", "mavlink_proto.PARAM_VALUE_param_index", ftypes.UINT16, nil)

f.PARAM_SET_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.PARAM_SET_target_system", ftypes.UINT8, nil)
f.PARAM_SET_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.PARAM_SET_target_component", ftypes.UINT8, nil)
f.PARAM_SET_param_id = ProtoField.new("param_id (char)", "mavlink_proto.PARAM_SET_param_id", ftypes.STRING, nil)
f.PARAM_SET_param_value = ProtoField.new("param_value (float)", "mavlink_proto.PARAM_SET_param_value", ftypes.FLOAT, nil)
f.PARAM_SET_param_type = ProtoField.new("param_type (MAV_PARAM_TYPE)", "mavlink_proto.PARAM_SET_param_type", ftypes.UINT8, enumEntryName.MAV_PARAM_TYPE)

f.ATTITUDE_time_boot_ms = ProtoField.new("time_boot_ms (uint32_t) [ms]", "mavlink_proto.ATTITUDE_time_boot_ms", ftypes.UINT32, nil)
f.ATTITUDE_roll = ProtoField.new("roll (float) [rad]", "mavlink_proto.ATTITUDE_roll", ftypes.FLOAT, nil)
f.ATTITUDE_pitch = ProtoField.new("pitch (float) [rad]", "mavlink_proto.ATTITUDE_pitch", ftypes.FLOAT, nil)
f.ATTITUDE_yaw = ProtoField.new("yaw (float) [rad]", "mavlink_proto.ATTITUDE_yaw", ftypes.FLOAT, nil)
f.ATTITUDE_rollspeed = ProtoField.new("rollspeed (float) [rad/s]", "mavlink_proto.ATTITUDE_rollspeed", ftypes.FLOAT, nil)
f.ATTITUDE_pitchspeed = ProtoField.new("pitchspeed (float) [rad/s]", "mavlink_proto.ATTITUDE_pitchspeed", ftypes.FLOAT, nil)
f.ATTITUDE_yawspeed = ProtoField.new("yawspeed (float) [rad/s]", "mavlink_proto.ATTITUDE_yawspeed", ftypes.FLOAT, nil)

f.LOCAL_POSITION_NED_time_boot_ms = ProtoField.new("time_boot_ms (uint32_t) [ms]", "mavlink_proto.LOCAL_POSITION_NED_time_boot_ms", ftypes.UINT32, nil)
f.LOCAL_POSITION_NED_x = ProtoField.new("x (float) [m]", "mavlink_proto.LOCAL_POSITION_NED_x", ftypes.FLOAT, nil)
f.LOCAL_POSITION_NED_y = ProtoField.new("y (float) [m]", "mavlink_proto.LOCAL_POSITION_NED_y", ftypes.FLOAT, nil)
f.LOCAL_POSITION_NED_z = ProtoField.new("z (float) [m]", "mavlink_proto.LOCAL_POSITION_NED_z", ftypes.FLOAT, nil)
f.LOCAL_POSITION_NED_vx = ProtoField.new("vx (float) [m/s]", "mavlink_proto.LOCAL_POSITION_NED_vx", ftypes.FLOAT, nil)
f.LOCAL_POSITION_NED_vy = ProtoField.new("vy (float) [m/s]", "mavlink_proto.LOCAL_POSITION_NED_vy", ftypes.FLOAT, nil)
f.LOCAL_POSITION_NED_vz = ProtoField.new("vz (float) [m/s]", "mavlink_proto.LOCAL_POSITION_NED_vz", ftypes.FLOAT, nil)

f.MISSION_ITEM_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.MISSION_ITEM_target_system", ftypes.UINT8, nil)
f.MISSION_ITEM_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.MISSION_ITEM_target_component", ftypes.UINT8, nil)
f.MISSION_ITEM_seq = ProtoField.new("seq (uint16_t)", "mavlink_proto.MISSION_ITEM_seq", ftypes.UINT16, nil)
f.MISSION_ITEM_frame = ProtoField.new("frame (MAV_FRAME)", "mavlink_proto.MISSION_ITEM_frame", ftypes.UINT8, enumEntryName.MAV_FRAME)
f.MISSION_ITEM_command = ProtoField.new("command (MAV_CMD)", "mavlink_proto.MISSION_ITEM_command", ftypes.UINT16, enumEntryName.MAV_CMD)
f.MISSION_ITEM_current = ProtoField.new("current (uint8_t)", "mavlink_proto.MISSION_ITEM_current", ftypes.UINT8, nil)
f.MISSION_ITEM_autocontinue = ProtoField.new("autocontinue (uint8_t)", "mavlink_proto.MISSION_ITEM_autocontinue", ftypes.UINT8, nil)
f.MISSION_ITEM_param1 = ProtoField.new("param1 (float)", "mavlink_proto.MISSION_ITEM_param1", ftypes.FLOAT, nil)
f.MISSION_ITEM_param2 = ProtoField.new("param2 (float)", "mavlink_proto.MISSION_ITEM_param2", ftypes.FLOAT, nil)
f.MISSION_ITEM_param3 = ProtoField.new("param3 (float)", "mavlink_proto.MISSION_ITEM_param3", ftypes.FLOAT, nil)
f.MISSION_ITEM_param4 = ProtoField.new("param4 (float)", "mavlink_proto.MISSION_ITEM_param4", ftypes.FLOAT, nil)
f.MISSION_ITEM_x = ProtoField.new("x (float)", "mavlink_proto.MISSION_ITEM_x", ftypes.FLOAT, nil)
f.MISSION_ITEM_y = ProtoField.new("y (float)", "mavlink_proto.MISSION_ITEM_y", ftypes.FLOAT, nil)
f.MISSION_ITEM_z = ProtoField.new("z (float)", "mavlink_proto.MISSION_ITEM_z", ftypes.FLOAT, nil)
f.MISSION_ITEM_mission_type = ProtoField.new("mission_type (MAV_MISSION_TYPE)", "mavlink_proto.MISSION_ITEM_mission_type", ftypes.UINT8, enumEntryName.MAV_MISSION_TYPE)

f.MISSION_REQUEST_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.MISSION_REQUEST_target_system", ftypes.UINT8, nil)
f.MISSION_REQUEST_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.MISSION_REQUEST_target_component", ftypes.UINT8, nil)
f.MISSION_REQUEST_seq = ProtoField.new("seq (uint16_t)", "mavlink_proto.MISSION_REQUEST_seq", ftypes.UINT16, nil)
f.MISSION_REQUEST_mission_type = ProtoField.new("mission_type (MAV_MISSION_TYPE)", "mavlink_proto.MISSION_REQUEST_mission_type", ftypes.UINT8, enumEntryName.MAV_MISSION_TYPE)

f.MISSION_SET_CURRENT_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.MISSION_SET_CURRENT_target_system", ftypes.UINT8, nil)
f.MISSION_SET_CURRENT_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.MISSION_SET_CURRENT_target_component", ftypes.UINT8, nil)
f.MISSION_SET_CURRENT_seq = ProtoField.new("seq (uint16_t)", "mavlink_proto.MISSION_SET_CURRENT_seq", ftypes.UINT16, nil)

f.MISSION_CURRENT_seq = ProtoField.new("seq (uint16_t)", "mavlink_proto.MISSION_CURRENT_seq", ftypes.UINT16, nil)
f.MISSION_CURRENT_total = ProtoField.new("total (uint16_t)", "mavlink_proto.MISSION_CURRENT_total", ftypes.UINT16, nil)
f.MISSION_CURRENT_mission_state = ProtoField.new("mission_state (MISSION_STATE)", "mavlink_proto.MISSION_CURRENT_mission_state", ftypes.UINT8, enumEntryName.MISSION_STATE)
f.MISSION_CURRENT_mission_mode = ProtoField.new("mission_mode (uint8_t)", "mavlink_proto.MISSION_CURRENT_mission_mode", ftypes.UINT8, nil)

f.MISSION_REQUEST_LIST_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.MISSION_REQUEST_LIST_target_system", ftypes.UINT8, nil)
f.MISSION_REQUEST_LIST_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.MISSION_REQUEST_LIST_target_component", ftypes.UINT8, nil)
f.MISSION_REQUEST_LIST_mission_type = ProtoField.new("mission_type (MAV_MISSION_TYPE)", "mavlink_proto.MISSION_REQUEST_LIST_mission_type", ftypes.UINT8, enumEntryName.MAV_MISSION_TYPE)

f.MISSION_COUNT_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.MISSION_COUNT_target_system", ftypes.UINT8, nil)
f.MISSION_COUNT_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.MISSION_COUNT_target_component", ftypes.UINT8, nil)
f.MISSION_COUNT_count = ProtoField.new("count (uint16_t)", "mavlink_proto.MISSION_COUNT_count", ftypes.UINT16, nil)
f.MISSION_COUNT_mission_type = ProtoField.new("mission_type (MAV_MISSION_TYPE)", "mavlink_proto.MISSION_COUNT_mission_type", ftypes.UINT8, enumEntryName.MAV_MISSION_TYPE)

f.MISSION_CLEAR_ALL_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.MISSION_CLEAR_ALL_target_system", ftypes.UINT8, nil)
f.MISSION_CLEAR_ALL_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.MISSION_CLEAR_ALL_target_component", ftypes.UINT8, nil)
f.MISSION_CLEAR_ALL_mission_type = ProtoField.new("mission_type (MAV_MISSION_TYPE)", "mavlink_proto.MISSION_CLEAR_ALL_mission_type", ftypes.UINT8, enumEntryName.MAV_MISSION_TYPE)

f.MISSION_ITEM_REACHED_seq = ProtoField.new("seq (uint16_t)", "mavlink_proto.MISSION_ITEM_REACHED_seq", ftypes.UINT16, nil)

f.MISSION_ACK_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.MISSION_ACK_target_system", ftypes.UINT8, nil)
f.MISSION_ACK_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.MISSION_ACK_target_component", ftypes.UINT8, nil)
f.MISSION_ACK_type = ProtoField.new("type (MAV_MISSION_RESULT)", "mavlink_proto.MISSION_ACK_type", ftypes.UINT8, enumEntryName.MAV_MISSION_RESULT)
f.MISSION_ACK_mission_type = ProtoField.new("mission_type (MAV_MISSION_TYPE)", "mavlink_proto.MISSION_ACK_mission_type", ftypes.UINT8, enumEntryName.MAV_MISSION_TYPE)

f.GPS_GLOBAL_ORIGIN_latitude = ProtoField.new("latitude (int32_t) [degE7]", "mavlink_proto.GPS_GLOBAL_ORIGIN_latitude", ftypes.INT32, nil)
f.GPS_GLOBAL_ORIGIN_longitude = ProtoField.new("longitude (int32_t) [degE7]", "mavlink_proto.GPS_GLOBAL_ORIGIN_longitude", ftypes.INT32, nil)
f.GPS_GLOBAL_ORIGIN_altitude = ProtoField.new("altitude (int32_t) [mm]", "mavlink_proto.GPS_GLOBAL_ORIGIN_altitude", ftypes.INT32, nil)
f.GPS_GLOBAL_ORIGIN_time_usec = ProtoField.new("time_usec (uint64_t) [us]", "mavlink_proto.GPS_GLOBAL_ORIGIN_time_usec", ftypes.UINT64, nil)

f.MISSION_REQUEST_INT_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.MISSION_REQUEST_INT_target_system", ftypes.UINT8, nil)
f.MISSION_REQUEST_INT_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.MISSION_REQUEST_INT_target_component", ftypes.UINT8, nil)
f.MISSION_REQUEST_INT_seq = ProtoField.new("seq (uint16_t)", "mavlink_proto.MISSION_REQUEST_INT_seq", ftypes.UINT16, nil)
f.MISSION_REQUEST_INT_mission_type = ProtoField.new("mission_type (MAV_MISSION_TYPE)", "mavlink_proto.MISSION_REQUEST_INT_mission_type", ftypes.UINT8, enumEntryName.MAV_MISSION_TYPE)

f.MISSION_ITEM_INT_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.MISSION_ITEM_INT_target_system", ftypes.UINT8, nil)
f.MISSION_ITEM_INT_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.MISSION_ITEM_INT_target_component", ftypes.UINT8, nil)
f.MISSION_ITEM_INT_seq = ProtoField.new("seq (uint16_t)", "mavlink_proto.MISSION_ITEM_INT_seq", ftypes.UINT16, nil)
f.MISSION_ITEM_INT_frame = ProtoField.new("frame (MAV_FRAME)", "mavlink_proto.MISSION_ITEM_INT_frame", ftypes.UINT8, enumEntryName.MAV_FRAME)
f.MISSION_ITEM_INT_command = ProtoField.new("command (MAV_CMD)", "mavlink_proto.MISSION_ITEM_INT_command", ftypes.UINT16, enumEntryName.MAV_CMD)
f.MISSION_ITEM_INT_current = ProtoField.new("current (uint8_t)", "mavlink_proto.MISSION_ITEM_INT_current", ftypes.UINT8, nil)
f.MISSION_ITEM_INT_autocontinue = ProtoField.new("autocontinue (uint8_t)", "mavlink_proto.MISSION_ITEM_INT_autocontinue", ftypes.UINT8, nil)
f.MISSION_ITEM_INT_param1 = ProtoField.new("param1 (float)", "mavlink_proto.MISSION_ITEM_INT_param1", ftypes.FLOAT, nil)
f.MISSION_ITEM_INT_param2 = ProtoField.new("param2 (float)", "mavlink_proto.MISSION_ITEM_INT_param2", ftypes.FLOAT, nil)
f.MISSION_ITEM_INT_param3 = ProtoField.new("param3 (float)", "mavlink_proto.MISSION_ITEM_INT_param3", ftypes.FLOAT, nil)
f.MISSION_ITEM_INT_param4 = ProtoField.new("param4 (float)", "mavlink_proto.MISSION_ITEM_INT_param4", ftypes.FLOAT, nil)
f.MISSION_ITEM_INT_x = ProtoField.new("x (int32_t)", "mavlink_proto.MISSION_ITEM_INT_x", ftypes.INT32, nil)
f.MISSION_ITEM_INT_y = ProtoField.new("y (int32_t)", "mavlink_proto.MISSION_ITEM_INT_y", ftypes.INT32, nil)
f.MISSION_ITEM_INT_z = ProtoField.new("z (float)", "mavlink_proto.MISSION_ITEM_INT_z", ftypes.FLOAT, nil)
f.MISSION_ITEM_INT_mission_type = ProtoField.new("mission_type (MAV_MISSION_TYPE)", "mavlink_proto.MISSION_ITEM_INT_mission_type", ftypes.UINT8, enumEntryName.MAV_MISSION_TYPE)

f.VFR_HUD_airspeed = ProtoField.new("airspeed (float) [m/s]", "mavlink_proto.VFR_HUD_airspeed", ftypes.FLOAT, nil)
f.VFR_HUD_groundspeed = ProtoField.new("groundspeed (float) [m/s]", "mavlink_proto.VFR_HUD_groundspeed", ftypes.FLOAT, nil)
f.VFR_HUD_heading = ProtoField.new("heading (int16_t) [deg]", "mavlink_proto.VFR_HUD_heading", ftypes.INT16, nil)
f.VFR_HUD_throttle = ProtoField.new("throttle (uint16_t) [%]", "mavlink_proto.VFR_HUD_throttle", ftypes.UINT16, nil)
f.VFR_HUD_alt = ProtoField.new("alt (float) [m]", "mavlink_proto.VFR_HUD_alt", ftypes.FLOAT, nil)
f.VFR_HUD_climb = ProtoField.new("climb (float) [m/s]", "mavlink_proto.VFR_HUD_climb", ftypes.FLOAT, nil)

f.COMMAND_INT_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.COMMAND_INT_target_system", ftypes.UINT8, nil)
f.COMMAND_INT_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.COMMAND_INT_target_component", ftypes.UINT8, nil)
f.COMMAND_INT_frame = ProtoField.new("frame (MAV_FRAME)", "mavlink_proto.COMMAND_INT_frame", ftypes.UINT8, enumEntryName.MAV_FRAME)
f.COMMAND_INT_command = ProtoField.new("command (MAV_CMD)", "mavlink_proto.COMMAND_INT_command", ftypes.UINT16, enumEntryName.MAV_CMD)
f.COMMAND_INT_current = ProtoField.new("current (uint8_t)", "mavlink_proto.COMMAND_INT_current", ftypes.UINT8, nil)
f.COMMAND_INT_autocontinue = ProtoField.new("autocontinue (uint8_t)", "mavlink_proto.COMMAND_INT_autocontinue", ftypes.UINT8, nil)
f.COMMAND_INT_param1 = ProtoField.new("param1 (float)", "mavlink_proto.COMMAND_INT_param1", ftypes.FLOAT, nil)
f.COMMAND_INT_param2 = ProtoField.new("param2 (float)", "mavlink_proto.COMMAND_INT_param2", ftypes.FLOAT, nil)
f.COMMAND_INT_param3 = ProtoField.new("param3 (float)", "mavlink_proto.COMMAND_INT_param3", ftypes.FLOAT, nil)
f.COMMAND_INT_param4 = ProtoField.new("param4 (float)", "mavlink_proto.COMMAND_INT_param4", ftypes.FLOAT, nil)
f.COMMAND_INT_x = ProtoField.new("x (int32_t)", "mavlink_proto.COMMAND_INT_x", ftypes.INT32, nil)
f.COMMAND_INT_y = ProtoField.new("y (int32_t)", "mavlink_proto.COMMAND_INT_y", ftypes.INT32, nil)
f.COMMAND_INT_z = ProtoField.new("z (float)", "mavlink_proto.COMMAND_INT_z", ftypes.FLOAT, nil)

f.COMMAND_LONG_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.COMMAND_LONG_target_system", ftypes.UINT8, nil)
f.COMMAND_LONG_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.COMMAND_LONG_target_component", ftypes.UINT8, nil)
f.COMMAND_LONG_command = ProtoField.new("command (MAV_CMD)", "mavlink_proto.COMMAND_LONG_command", ftypes.UINT16, enumEntryName.MAV_CMD)
f.COMMAND_LONG_confirmation = ProtoField.new("confirmation (uint8_t)", "mavlink_proto.COMMAND_LONG_confirmation", ftypes.UINT8, nil)
f.COMMAND_LONG_param1 = ProtoField.new("param1 (float)", "mavlink_proto.COMMAND_LONG_param1", ftypes.FLOAT, nil)
f.COMMAND_LONG_param2 = ProtoField.new("param2 (float)", "mavlink_proto.COMMAND_LONG_param2", ftypes.FLOAT, nil)
f.COMMAND_LONG_param3 = ProtoField.new("param3 (float)", "mavlink_proto.COMMAND_LONG_param3", ftypes.FLOAT, nil)
f.COMMAND_LONG_param4 = ProtoField.new("param4 (float)", "mavlink_proto.COMMAND_LONG_param4", ftypes.FLOAT, nil)
f.COMMAND_LONG_param5 = ProtoField.new("param5 (float)", "mavlink_proto.COMMAND_LONG_param5", ftypes.FLOAT, nil)
f.COMMAND_LONG_param6 = ProtoField.new("param6 (float)", "mavlink_proto.COMMAND_LONG_param6", ftypes.FLOAT, nil)
f.COMMAND_LONG_param7 = ProtoField.new("param7 (float)", "mavlink_proto.COMMAND_LONG_param7", ftypes.FLOAT, nil)

f.COMMAND_ACK_command = ProtoField.new("command (MAV_CMD)", "mavlink_proto.COMMAND_ACK_command", ftypes.UINT16, enumEntryName.MAV_CMD)
f.COMMAND_ACK_result = ProtoField.new("result (MAV_RESULT)", "mavlink_proto.COMMAND_ACK_result", ftypes.UINT8, enumEntryName.MAV_RESULT)
f.COMMAND_ACK_progress = ProtoField.new("progress (uint8_t)", "mavlink_proto.COMMAND_ACK_progress", ftypes.UINT8, nil)
f.COMMAND_ACK_result_param2 = ProtoField.new("result_param2 (int32_t)", "mavlink_proto.COMMAND_ACK_result_param2", ftypes.INT32, nil)
f.COMMAND_ACK_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.COMMAND_ACK_target_system", ftypes.UINT8, nil)
f.COMMAND_ACK_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.COMMAND_ACK_target_component", ftypes.UINT8, nil)

f.HOME_POSITION_latitude = ProtoField.new("latitude (int32_t) [degE7]", "mavlink_proto.HOME_POSITION_latitude", ftypes.INT32, nil)
f.HOME_POSITION_longitude = ProtoField.new("longitude (int32_t) [degE7]", "mavlink_proto.HOME_POSITION_longitude", ftypes.INT32, nil)
f.HOME_POSITION_altitude = ProtoField.new("altitude (int32_t) [mm]", "mavlink_proto.HOME_POSITION_altitude", ftypes.INT32, nil)
f.HOME_POSITION_x = ProtoField.new("x (float) [m]", "mavlink_proto.HOME_POSITION_x", ftypes.FLOAT, nil)
f.HOME_POSITION_y = ProtoField.new("y (float) [m]", "mavlink_proto.HOME_POSITION_y", ftypes.FLOAT, nil)
f.HOME_POSITION_z = ProtoField.new("z (float) [m]", "mavlink_proto.HOME_POSITION_z", ftypes.FLOAT, nil)
f.HOME_POSITION_q_0 = ProtoField.new("q[0] (float)", "mavlink_proto.HOME_POSITION_q_0", ftypes.FLOAT, nil)
f.HOME_POSITION_q_1 = ProtoField.new("q[1] (float)", "mavlink_proto.HOME_POSITION_q_1", ftypes.FLOAT, nil)
f.HOME_POSITION_q_2 = ProtoField.new("q[2] (float)", "mavlink_proto.HOME_POSITION_q_2", ftypes.FLOAT, nil)
f.HOME_POSITION_q_3 = ProtoField.new("q[3] (float)", "mavlink_proto.HOME_POSITION_q_3", ftypes.FLOAT, nil)
f.HOME_POSITION_approach_x = ProtoField.new("approach_x (float) [m]", "mavlink_proto.HOME_POSITION_approach_x", ftypes.FLOAT, nil)
f.HOME_POSITION_approach_y = ProtoField.new("approach_y (float) [m]", "mavlink_proto.HOME_POSITION_approach_y", ftypes.FLOAT, nil)
f.HOME_POSITION_approach_z = ProtoField.new("approach_z (float) [m]", "mavlink_proto.HOME_POSITION_approach_z", ftypes.FLOAT, nil)
f.HOME_POSITION_time_usec = ProtoField.new("time_usec (uint64_t) [us]", "mavlink_proto.HOME_POSITION_time_usec", ftypes.UINT64, nil)

f.STATUSTEXT_severity = ProtoField.new("severity (MAV_SEVERITY)", "mavlink_proto.STATUSTEXT_severity", ftypes.UINT8, enumEntryName.MAV_SEVERITY)
f.STATUSTEXT_text = ProtoField.new("text (char)", "mavlink_proto.STATUSTEXT_text", ftypes.STRING, nil)
f.STATUSTEXT_id = ProtoField.new("id (uint16_t)", "mavlink_proto.STATUSTEXT_id", ftypes.UINT16, nil)
f.STATUSTEXT_chunk_seq = ProtoField.new("chunk_seq (uint8_t)", "mavlink_proto.STATUSTEXT_chunk_seq", ftypes.UINT8, nil)

f.PARAM_ERROR_target_system = ProtoField.new("target_system (uint8_t)", "mavlink_proto.PARAM_ERROR_target_system", ftypes.UINT8, nil)
f.PARAM_ERROR_target_component = ProtoField.new("target_component (uint8_t)", "mavlink_proto.PARAM_ERROR_target_component", ftypes.UINT8, nil)
f.PARAM_ERROR_param_id = ProtoField.new("param_id (char)", "mavlink_proto.PARAM_ERROR_param_id", ftypes.STRING, nil)
f.PARAM_ERROR_param_index = ProtoField.new("param_index (int16_t)", "mavlink_proto.PARAM_ERROR_param_index", ftypes.INT16, nil)
f.PARAM_ERROR_error = ProtoField.new("error (MAV_PARAM_ERROR)", "mavlink_proto.PARAM_ERROR_error", ftypes.UINT8, enumEntryName.MAV_PARAM_ERROR)

f.GLOBAL_POSITION_INT_time_boot_ms = ProtoField.new("time_boot_ms (uint32_t) [ms]", "mavlink_proto.GLOBAL_POSITION_INT_time_boot_ms", ftypes.UINT32, nil)
f.GLOBAL_POSITION_INT_lat = ProtoField.new("lat (int32_t) [degE7]", "mavlink_proto.GLOBAL_POSITION_INT_lat", ftypes.INT32, nil)
f.GLOBAL_POSITION_INT_lon = ProtoField.new("lon (int32_t) [degE7]", "mavlink_proto.GLOBAL_POSITION_INT_lon", ftypes.INT32, nil)
f.GLOBAL_POSITION_INT_alt = ProtoField.new("alt (int32_t) [mm]", "mavlink_proto.GLOBAL_POSITION_INT_alt", ftypes.INT32, nil)
f.GLOBAL_POSITION_INT_relative_alt = ProtoField.new("relative_alt (int32_t) [mm]", "mavlink_proto.GLOBAL_POSITION_INT_relative_alt", ftypes.INT32, nil)
f.GLOBAL_POSITION_INT_vx = ProtoField.new("vx (int16_t) [cm/s]", "mavlink_proto.GLOBAL_POSITION_INT_vx", ftypes.INT16, nil)
f.GLOBAL_POSITION_INT_vy = ProtoField.new("vy (int16_t) [cm/s]", "mavlink_proto.GLOBAL_POSITION_INT_vy", ftypes.INT16, nil)
f.GLOBAL_POSITION_INT_vz = ProtoField.new("vz (int16_t) [cm/s]", "mavlink_proto.GLOBAL_POSITION_INT_vz", ftypes.INT16, nil)
f.GLOBAL_POSITION_INT_hdg = ProtoField.new("hdg (uint16_t) [cdeg]", "mavlink_proto.GLOBAL_POSITION_INT_hdg", ftypes.UINT16, nil)

f.AUTOPILOT_VERSION_capabilities = ProtoField.new("capabilities (MAV_PROTOCOL_CAPABILITY)", "mavlink_proto.AUTOPILOT_VERSION_capabilities", ftypes.UINT64, nil, base.HEX_DEC)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_MISSION_FLOAT = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT", "MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT", 24, nil, 1)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_PARAM_FLOAT = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT", "MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT", 24, nil, 2)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_MISSION_INT = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_MISSION_INT", "MAV_PROTOCOL_CAPABILITY_MISSION_INT", 24, nil, 4)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_COMMAND_INT = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_COMMAND_INT", "MAV_PROTOCOL_CAPABILITY_COMMAND_INT", 24, nil, 8)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE", "MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE", 24, nil, 16)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_FTP = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_FTP", "MAV_PROTOCOL_CAPABILITY_FTP", 24, nil, 32)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET", "MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET", 24, nil, 64)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED", "MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED", 24, nil, 128)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT", "MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT", 24, nil, 256)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_TERRAIN = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_TERRAIN", "MAV_PROTOCOL_CAPABILITY_TERRAIN", 24, nil, 512)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_RESERVED3 = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_RESERVED3", "MAV_PROTOCOL_CAPABILITY_RESERVED3", 24, nil, 1024)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION", "MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION", 24, nil, 2048)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_COMPASS_CALIBRATION = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_COMPASS_CALIBRATION", "MAV_PROTOCOL_CAPABILITY_COMPASS_CALIBRATION", 24, nil, 4096)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_MAVLINK2 = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_MAVLINK2", "MAV_PROTOCOL_CAPABILITY_MAVLINK2", 24, nil, 8192)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_MISSION_FENCE = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE", "MAV_PROTOCOL_CAPABILITY_MISSION_FENCE", 24, nil, 16384)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_MISSION_RALLY = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY", "MAV_PROTOCOL_CAPABILITY_MISSION_RALLY", 24, nil, 32768)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_RESERVED2 = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_RESERVED2", "MAV_PROTOCOL_CAPABILITY_RESERVED2", 24, nil, 65536)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST", "MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST", 24, nil, 131072)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_COMPONENT_IMPLEMENTS_GIMBAL_MANAGER = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_COMPONENT_IMPLEMENTS_GIMBAL_MANAGER", "MAV_PROTOCOL_CAPABILITY_COMPONENT_IMPLEMENTS_GIMBAL_MANAGER", 24, nil, 262144)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_COMPONENT_ACCEPTS_GCS_CONTROL = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_COMPONENT_ACCEPTS_GCS_CONTROL", "MAV_PROTOCOL_CAPABILITY_COMPONENT_ACCEPTS_GCS_CONTROL", 24, nil, 524288)
f.AUTOPILOT_VERSION_capabilities_flagMAV_PROTOCOL_CAPABILITY_GRIPPER = ProtoField.bool("mavlink_proto.AUTOPILOT_VERSION_capabilities.MAV_PROTOCOL_CAPABILITY_GRIPPER", "MAV_PROTOCOL_CAPABILITY_GRIPPER", 24, nil, 1048576)
f.AUTOPILOT_VERSION_flight_sw_version = ProtoField.new("flight_sw_version (uint32_t)", "mavlink_proto.AUTOPILOT_VERSION_flight_sw_version", ftypes.UINT32, nil)
f.AUTOPILOT_VERSION_middleware_sw_version = ProtoField.new("middleware_sw_version (uint32_t)", "mavlink_proto.AUTOPILOT_VERSION_middleware_sw_version", ftypes.UINT32, nil)
f.AUTOPILOT_VERSION_os_sw_version = ProtoField.new("os_sw_version (uint32_t)", "mavlink_proto.AUTOPILOT_VERSION_os_sw_version", ftypes.UINT32, nil)
f.AUTOPILOT_VERSION_board_version = ProtoField.new("board_version (uint32_t)", "mavlink_proto.AUTOPILOT_VERSION_board_version", ftypes.UINT32, nil)
f.AUTOPILOT_VERSION_flight_custom_version_0 = ProtoField.new("flight_custom_version[0] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_flight_custom_version_0", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_flight_custom_version_1 = ProtoField.new("flight_custom_version[1] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_flight_custom_version_1", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_flight_custom_version_2 = ProtoField.new("flight_custom_version[2] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_flight_custom_version_2", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_flight_custom_version_3 = ProtoField.new("flight_custom_version[3] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_flight_custom_version_3", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_flight_custom_version_4 = ProtoField.new("flight_custom_version[4] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_flight_custom_version_4", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_flight_custom_version_5 = ProtoField.new("flight_custom_version[5] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_flight_custom_version_5", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_flight_custom_version_6 = ProtoField.new("flight_custom_version[6] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_flight_custom_version_6", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_flight_custom_version_7 = ProtoField.new("flight_custom_version[7] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_flight_custom_version_7", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_middleware_custom_version_0 = ProtoField.new("middleware_custom_version[0] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_middleware_custom_version_0", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_middleware_custom_version_1 = ProtoField.new("middleware_custom_version[1] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_middleware_custom_version_1", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_middleware_custom_version_2 = ProtoField.new("middleware_custom_version[2] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_middleware_custom_version_2", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_middleware_custom_version_3 = ProtoField.new("middleware_custom_version[3] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_middleware_custom_version_3", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_middleware_custom_version_4 = ProtoField.new("middleware_custom_version[4] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_middleware_custom_version_4", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_middleware_custom_version_5 = ProtoField.new("middleware_custom_version[5] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_middleware_custom_version_5", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_middleware_custom_version_6 = ProtoField.new("middleware_custom_version[6] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_middleware_custom_version_6", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_middleware_custom_version_7 = ProtoField.new("middleware_custom_version[7] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_middleware_custom_version_7", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_os_custom_version_0 = ProtoField.new("os_custom_version[0] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_os_custom_version_0", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_os_custom_version_1 = ProtoField.new("os_custom_version[1] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_os_custom_version_1", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_os_custom_version_2 = ProtoField.new("os_custom_version[2] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_os_custom_version_2", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_os_custom_version_3 = ProtoField.new("os_custom_version[3] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_os_custom_version_3", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_os_custom_version_4 = ProtoField.new("os_custom_version[4] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_os_custom_version_4", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_os_custom_version_5 = ProtoField.new("os_custom_version[5] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_os_custom_version_5", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_os_custom_version_6 = ProtoField.new("os_custom_version[6] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_os_custom_version_6", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_os_custom_version_7 = ProtoField.new("os_custom_version[7] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_os_custom_version_7", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_vendor_id = ProtoField.new("vendor_id (uint16_t)", "mavlink_proto.AUTOPILOT_VERSION_vendor_id", ftypes.UINT16, nil)
f.AUTOPILOT_VERSION_product_id = ProtoField.new("product_id (uint16_t)", "mavlink_proto.AUTOPILOT_VERSION_product_id", ftypes.UINT16, nil)
f.AUTOPILOT_VERSION_uid = ProtoField.new("uid (uint64_t)", "mavlink_proto.AUTOPILOT_VERSION_uid", ftypes.UINT64, nil)
f.AUTOPILOT_VERSION_uid2_0 = ProtoField.new("uid2[0] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_0", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_1 = ProtoField.new("uid2[1] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_1", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_2 = ProtoField.new("uid2[2] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_2", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_3 = ProtoField.new("uid2[3] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_3", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_4 = ProtoField.new("uid2[4] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_4", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_5 = ProtoField.new("uid2[5] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_5", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_6 = ProtoField.new("uid2[6] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_6", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_7 = ProtoField.new("uid2[7] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_7", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_8 = ProtoField.new("uid2[8] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_8", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_9 = ProtoField.new("uid2[9] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_9", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_10 = ProtoField.new("uid2[10] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_10", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_11 = ProtoField.new("uid2[11] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_11", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_12 = ProtoField.new("uid2[12] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_12", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_13 = ProtoField.new("uid2[13] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_13", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_14 = ProtoField.new("uid2[14] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_14", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_15 = ProtoField.new("uid2[15] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_15", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_16 = ProtoField.new("uid2[16] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_16", ftypes.UINT8, nil)
f.AUTOPILOT_VERSION_uid2_17 = ProtoField.new("uid2[17] (uint8_t)", "mavlink_proto.AUTOPILOT_VERSION_uid2_17", ftypes.UINT8, nil)

f.HEARTBEAT_type = ProtoField.new("type (MAV_TYPE)", "mavlink_proto.HEARTBEAT_type", ftypes.UINT8, enumEntryName.MAV_TYPE)
f.HEARTBEAT_autopilot = ProtoField.new("autopilot (MAV_AUTOPILOT)", "mavlink_proto.HEARTBEAT_autopilot", ftypes.UINT8, enumEntryName.MAV_AUTOPILOT)
f.HEARTBEAT_base_mode = ProtoField.new("base_mode (MAV_MODE_FLAG)", "mavlink_proto.HEARTBEAT_base_mode", ftypes.UINT8, nil, base.HEX_DEC)
f.HEARTBEAT_base_mode_flagMAV_MODE_FLAG_CUSTOM_MODE_ENABLED = ProtoField.bool("mavlink_proto.HEARTBEAT_base_mode.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED", "MAV_MODE_FLAG_CUSTOM_MODE_ENABLED", 8, nil, 1)
f.HEARTBEAT_base_mode_flagMAV_MODE_FLAG_TEST_ENABLED = ProtoField.bool("mavlink_proto.HEARTBEAT_base_mode.MAV_MODE_FLAG_TEST_ENABLED", "MAV_MODE_FLAG_TEST_ENABLED", 8, nil, 2)
f.HEARTBEAT_base_mode_flagMAV_MODE_FLAG_AUTO_ENABLED = ProtoField.bool("mavlink_proto.HEARTBEAT_base_mode.MAV_MODE_FLAG_AUTO_ENABLED", "MAV_MODE_FLAG_AUTO_ENABLED", 8, nil, 4)
f.HEARTBEAT_base_mode_flagMAV_MODE_FLAG_GUIDED_ENABLED = ProtoField.bool("mavlink_proto.HEARTBEAT_base_mode.MAV_MODE_FLAG_GUIDED_ENABLED", "MAV_MODE_FLAG_GUIDED_ENABLED", 8, nil, 8)
f.HEARTBEAT_base_mode_flagMAV_MODE_FLAG_STABILIZE_ENABLED = ProtoField.bool("mavlink_proto.HEARTBEAT_base_mode.MAV_MODE_FLAG_STABILIZE_ENABLED", "MAV_MODE_FLAG_STABILIZE_ENABLED", 8, nil, 16)
f.HEARTBEAT_base_mode_flagMAV_MODE_FLAG_HIL_ENABLED = ProtoField.bool("mavlink_proto.HEARTBEAT_base_mode.MAV_MODE_FLAG_HIL_ENABLED", "MAV_MODE_FLAG_HIL_ENABLED", 8, nil, 32)
f.HEARTBEAT_base_mode_flagMAV_MODE_FLAG_MANUAL_INPUT_ENABLED = ProtoField.bool("mavlink_proto.HEARTBEAT_base_mode.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED", "MAV_MODE_FLAG_MANUAL_INPUT_ENABLED", 8, nil, 64)
f.HEARTBEAT_base_mode_flagMAV_MODE_FLAG_SAFETY_ARMED = ProtoField.bool("mavlink_proto.HEARTBEAT_base_mode.MAV_MODE_FLAG_SAFETY_ARMED", "MAV_MODE_FLAG_SAFETY_ARMED", 8, nil, 128)
f.HEARTBEAT_custom_mode = ProtoField.new("custom_mode (uint32_t)", "mavlink_proto.HEARTBEAT_custom_mode", ftypes.UINT32, nil)
f.HEARTBEAT_system_status = ProtoField.new("system_status (MAV_STATE)", "mavlink_proto.HEARTBEAT_system_status", ftypes.UINT8, enumEntryName.MAV_STATE)
f.HEARTBEAT_mavlink_version = ProtoField.new("mavlink_version (uint8_t)", "mavlink_proto.HEARTBEAT_mavlink_version", ftypes.UINT8, nil)

-- dissect flag field
function dissect_flags_MAV_SYS_STATUS_SENSOR(tree, name, tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_3D_GYRO"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_3D_ACCEL"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_3D_MAG"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_GPS"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_OPTICAL_FLOW"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_VISION_POSITION"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_LASER_POSITION"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_EXTERNAL_GROUND_TRUTH"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_YAW_POSITION"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_RC_RECEIVER"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_3D_GYRO2"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_3D_ACCEL2"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_3D_MAG2"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_GEOFENCE"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_AHRS"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_TERRAIN"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_REVERSE_MOTOR"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_LOGGING"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_BATTERY"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_PROXIMITY"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_SATCOM"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_PREARM_CHECK"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_OBSTACLE_AVOIDANCE"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_PROPULSION"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_EXTENSION_USED"], tvbrange, value)
end
-- dissect flag field
function dissect_flags_MAV_SYS_STATUS_SENSOR_EXTENDED(tree, name, tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_RECOVERY_SYSTEM"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_SYS_STATUS_SENSOR_LEAK"], tvbrange, value)
end
-- dissect flag field
function dissect_flags_MAV_DO_REPOSITION_FLAGS(tree, name, tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_DO_REPOSITION_FLAGS_CHANGE_MODE"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_DO_REPOSITION_FLAGS_RELATIVE_YAW"], tvbrange, value)
end
-- dissect flag field
function dissect_flags_MAV_BOOL(tree, name, tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_BOOL_TRUE"], tvbrange, value)
end
-- dissect flag field
function dissect_flags_MAV_PROTOCOL_CAPABILITY(tree, name, tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_MISSION_FLOAT"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_PARAM_FLOAT"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_MISSION_INT"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_COMMAND_INT"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_FTP"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_TERRAIN"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_RESERVED3"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_COMPASS_CALIBRATION"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_MAVLINK2"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_MISSION_FENCE"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_MISSION_RALLY"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_RESERVED2"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_COMPONENT_IMPLEMENTS_GIMBAL_MANAGER"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_COMPONENT_ACCEPTS_GCS_CONTROL"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_PROTOCOL_CAPABILITY_GRIPPER"], tvbrange, value)
end
-- dissect flag field
function dissect_flags_MAV_MODE_FLAG(tree, name, tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_MODE_FLAG_CUSTOM_MODE_ENABLED"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_MODE_FLAG_TEST_ENABLED"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_MODE_FLAG_AUTO_ENABLED"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_MODE_FLAG_GUIDED_ENABLED"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_MODE_FLAG_STABILIZE_ENABLED"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_MODE_FLAG_HIL_ENABLED"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_MODE_FLAG_MANUAL_INPUT_ENABLED"], tvbrange, value)
    tree:add_le(f[name .. "_flagMAV_MODE_FLAG_SAFETY_ARMED"], tvbrange, value)
end
-- dissect payload of message type ROVER_STATE
function payload_fns.payload_52001(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 40 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 40)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.ROVER_STATE_time_boot_ms, tvbrange)
    tvbrange = padded(offset + 0, 8)
    subtree = tree:add_le(f.ROVER_STATE_faults, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.ROVER_STATE_goal_east, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.ROVER_STATE_goal_north, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.ROVER_STATE_distance, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.ROVER_STATE_speed, tvbrange)
    tvbrange = padded(offset + 28, 4)
    subtree = tree:add_le(f.ROVER_STATE_sigma_position, tvbrange)
    tvbrange = padded(offset + 32, 4)
    subtree = tree:add_le(f.ROVER_STATE_sigma_yaw, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg)",value*180/math.pi))
    tvbrange = padded(offset + 36, 2)
    subtree = tree:add_le(f.ROVER_STATE_stop, tvbrange)
    tvbrange = padded(offset + 38, 1)
    subtree = tree:add_le(f.ROVER_STATE_mode, tvbrange)
    tvbrange = padded(offset + 39, 1)
    subtree = tree:add_le(f.ROVER_STATE_phase, tvbrange)
end
-- dissect payload of message type WHEELS
function payload_fns.payload_52002(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 40 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 40)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.WHEELS_time_boot_ms, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.WHEELS_steer_0, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg)",value*180/math.pi))
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.WHEELS_steer_1, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg)",value*180/math.pi))
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.WHEELS_steer_2, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg)",value*180/math.pi))
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.WHEELS_steer_3, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg)",value*180/math.pi))
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.WHEELS_rate_0, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg/s)",value*180/math.pi))
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.WHEELS_rate_1, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg/s)",value*180/math.pi))
    tvbrange = padded(offset + 28, 4)
    subtree = tree:add_le(f.WHEELS_rate_2, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg/s)",value*180/math.pi))
    tvbrange = padded(offset + 32, 4)
    subtree = tree:add_le(f.WHEELS_rate_3, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg/s)",value*180/math.pi))
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.WHEELS_state_0, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.WHEELS_state_1, tvbrange)
    tvbrange = padded(offset + 38, 1)
    subtree = tree:add_le(f.WHEELS_state_2, tvbrange)
    tvbrange = padded(offset + 39, 1)
    subtree = tree:add_le(f.WHEELS_state_3, tvbrange)
end
-- dissect payload of message type ITEMS
function payload_fns.payload_52003(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 52 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 52)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.ITEMS_time_boot_ms, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.ITEMS_value_0, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.ITEMS_value_1, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.ITEMS_value_2, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.ITEMS_value_3, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.ITEMS_value_4, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.ITEMS_value_5, tvbrange)
    tvbrange = padded(offset + 28, 4)
    subtree = tree:add_le(f.ITEMS_value_6, tvbrange)
    tvbrange = padded(offset + 32, 4)
    subtree = tree:add_le(f.ITEMS_value_7, tvbrange)
    tvbrange = padded(offset + 36, 2)
    subtree = tree:add_le(f.ITEMS_item_0, tvbrange)
    tvbrange = padded(offset + 38, 2)
    subtree = tree:add_le(f.ITEMS_item_1, tvbrange)
    tvbrange = padded(offset + 40, 2)
    subtree = tree:add_le(f.ITEMS_item_2, tvbrange)
    tvbrange = padded(offset + 42, 2)
    subtree = tree:add_le(f.ITEMS_item_3, tvbrange)
    tvbrange = padded(offset + 44, 2)
    subtree = tree:add_le(f.ITEMS_item_4, tvbrange)
    tvbrange = padded(offset + 46, 2)
    subtree = tree:add_le(f.ITEMS_item_5, tvbrange)
    tvbrange = padded(offset + 48, 2)
    subtree = tree:add_le(f.ITEMS_item_6, tvbrange)
    tvbrange = padded(offset + 50, 2)
    subtree = tree:add_le(f.ITEMS_item_7, tvbrange)
end
-- dissect payload of message type PROGRESS
function payload_fns.payload_52004(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 24 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 24)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.PROGRESS_time_boot_ms, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.PROGRESS_ratio, tvbrange)
    tvbrange = padded(offset + 8, 16)
    subtree = tree:add_le(f.PROGRESS_job, tvbrange)
end
-- dissect payload of message type EVENT
function payload_fns.payload_52005(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 149 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 149)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 8)
    subtree = tree:add_le(f.EVENT_time_boot_us, tvbrange)
    value = tvbrange:le_uint64()
    subtree:append_text(time_usec_decode(value))
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.EVENT_serial, tvbrange)
    tvbrange = padded(offset + 12, 1)
    subtree = tree:add_le(f.EVENT_severity, tvbrange)
    tvbrange = padded(offset + 13, 24)
    subtree = tree:add_le(f.EVENT_name, tvbrange)
    tvbrange = padded(offset + 37, 112)
    subtree = tree:add_le(f.EVENT_text, tvbrange)
end
-- dissect payload of message type LINK_STATE
function payload_fns.payload_52010(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 18 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 18)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.LINK_STATE_time_boot_ms, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.LINK_STATE_dictionary, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.LINK_STATE_dbc, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.LINK_STATE_dialect, tvbrange)
    tvbrange = padded(offset + 16, 1)
    subtree = tree:add_le(f.LINK_STATE_lease, tvbrange)
    tvbrange = padded(offset + 17, 1)
    subtree = tree:add_le(f.LINK_STATE_epoch, tvbrange)
end
-- dissect payload of message type SYS_STATUS
function payload_fns.payload_1(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 43 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 43)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.SYS_STATUS_onboard_control_sensors_present, tvbrange)
    value = tvbrange:le_uint()
    dissect_flags_MAV_SYS_STATUS_SENSOR(subtree, "SYS_STATUS_onboard_control_sensors_present", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.SYS_STATUS_onboard_control_sensors_enabled, tvbrange)
    value = tvbrange:le_uint()
    dissect_flags_MAV_SYS_STATUS_SENSOR(subtree, "SYS_STATUS_onboard_control_sensors_enabled", tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.SYS_STATUS_onboard_control_sensors_health, tvbrange)
    value = tvbrange:le_uint()
    dissect_flags_MAV_SYS_STATUS_SENSOR(subtree, "SYS_STATUS_onboard_control_sensors_health", tvbrange, value)
    tvbrange = padded(offset + 12, 2)
    subtree = tree:add_le(f.SYS_STATUS_load, tvbrange)
    tvbrange = padded(offset + 14, 2)
    subtree = tree:add_le(f.SYS_STATUS_voltage_battery, tvbrange)
    tvbrange = padded(offset + 16, 2)
    subtree = tree:add_le(f.SYS_STATUS_current_battery, tvbrange)
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.SYS_STATUS_battery_remaining, tvbrange)
    tvbrange = padded(offset + 18, 2)
    subtree = tree:add_le(f.SYS_STATUS_drop_rate_comm, tvbrange)
    tvbrange = padded(offset + 20, 2)
    subtree = tree:add_le(f.SYS_STATUS_errors_comm, tvbrange)
    tvbrange = padded(offset + 22, 2)
    subtree = tree:add_le(f.SYS_STATUS_errors_count1, tvbrange)
    tvbrange = padded(offset + 24, 2)
    subtree = tree:add_le(f.SYS_STATUS_errors_count2, tvbrange)
    tvbrange = padded(offset + 26, 2)
    subtree = tree:add_le(f.SYS_STATUS_errors_count3, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.SYS_STATUS_errors_count4, tvbrange)
    tvbrange = padded(offset + 31, 4)
    subtree = tree:add_le(f.SYS_STATUS_onboard_control_sensors_present_extended, tvbrange)
    value = tvbrange:le_uint()
    dissect_flags_MAV_SYS_STATUS_SENSOR_EXTENDED(subtree, "SYS_STATUS_onboard_control_sensors_present_extended", tvbrange, value)
    tvbrange = padded(offset + 35, 4)
    subtree = tree:add_le(f.SYS_STATUS_onboard_control_sensors_enabled_extended, tvbrange)
    value = tvbrange:le_uint()
    dissect_flags_MAV_SYS_STATUS_SENSOR_EXTENDED(subtree, "SYS_STATUS_onboard_control_sensors_enabled_extended", tvbrange, value)
    tvbrange = padded(offset + 39, 4)
    subtree = tree:add_le(f.SYS_STATUS_onboard_control_sensors_health_extended, tvbrange)
    value = tvbrange:le_uint()
    dissect_flags_MAV_SYS_STATUS_SENSOR_EXTENDED(subtree, "SYS_STATUS_onboard_control_sensors_health_extended", tvbrange, value)
end
-- dissect payload of message type SET_MODE
function payload_fns.payload_11(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 6 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 6)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 4, 1)
    subtree = tree:add_le(f.SET_MODE_target_system, tvbrange)
    tvbrange = padded(offset + 5, 1)
    subtree = tree:add_le(f.SET_MODE_base_mode, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.SET_MODE_custom_mode, tvbrange)
end
-- dissect payload of message type PARAM_REQUEST_READ
function payload_fns.payload_20(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 20 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 20)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.PARAM_REQUEST_READ_target_system, tvbrange)
    tvbrange = padded(offset + 3, 1)
    subtree = tree:add_le(f.PARAM_REQUEST_READ_target_component, tvbrange)
    tvbrange = padded(offset + 4, 16)
    subtree = tree:add_le(f.PARAM_REQUEST_READ_param_id, tvbrange)
    tvbrange = padded(offset + 0, 2)
    subtree = tree:add_le(f.PARAM_REQUEST_READ_param_index, tvbrange)
end
-- dissect payload of message type PARAM_REQUEST_LIST
function payload_fns.payload_21(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 2 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 2)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 1)
    subtree = tree:add_le(f.PARAM_REQUEST_LIST_target_system, tvbrange)
    tvbrange = padded(offset + 1, 1)
    subtree = tree:add_le(f.PARAM_REQUEST_LIST_target_component, tvbrange)
end
-- dissect payload of message type PARAM_VALUE
function payload_fns.payload_22(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 25 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 25)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 8, 16)
    subtree = tree:add_le(f.PARAM_VALUE_param_id, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.PARAM_VALUE_param_value, tvbrange)
    tvbrange = padded(offset + 24, 1)
    subtree = tree:add_le(f.PARAM_VALUE_param_type, tvbrange)
    tvbrange = padded(offset + 4, 2)
    subtree = tree:add_le(f.PARAM_VALUE_param_count, tvbrange)
    tvbrange = padded(offset + 6, 2)
    subtree = tree:add_le(f.PARAM_VALUE_param_index, tvbrange)
end
-- dissect payload of message type PARAM_SET
function payload_fns.payload_23(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 23 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 23)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 4, 1)
    subtree = tree:add_le(f.PARAM_SET_target_system, tvbrange)
    tvbrange = padded(offset + 5, 1)
    subtree = tree:add_le(f.PARAM_SET_target_component, tvbrange)
    tvbrange = padded(offset + 6, 16)
    subtree = tree:add_le(f.PARAM_SET_param_id, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.PARAM_SET_param_value, tvbrange)
    tvbrange = padded(offset + 22, 1)
    subtree = tree:add_le(f.PARAM_SET_param_type, tvbrange)
end
-- dissect payload of message type ATTITUDE
function payload_fns.payload_30(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 28 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 28)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.ATTITUDE_time_boot_ms, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.ATTITUDE_roll, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg)",value*180/math.pi))
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.ATTITUDE_pitch, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg)",value*180/math.pi))
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.ATTITUDE_yaw, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg)",value*180/math.pi))
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.ATTITUDE_rollspeed, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg/s)",value*180/math.pi))
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.ATTITUDE_pitchspeed, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg/s)",value*180/math.pi))
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.ATTITUDE_yawspeed, tvbrange)
    value = tvbrange:le_float()
    subtree:append_text(string.format(" (%g deg/s)",value*180/math.pi))
end
-- dissect payload of message type LOCAL_POSITION_NED
function payload_fns.payload_32(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 28 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 28)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.LOCAL_POSITION_NED_time_boot_ms, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.LOCAL_POSITION_NED_x, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.LOCAL_POSITION_NED_y, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.LOCAL_POSITION_NED_z, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.LOCAL_POSITION_NED_vx, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.LOCAL_POSITION_NED_vy, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.LOCAL_POSITION_NED_vz, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_NAV_RETURN_TO_LAUNCH
function payload_fns.payload_39_cmd20(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_CONDITION_YAW
function payload_fns.payload_39_cmd115(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param4, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_CONDITION_YAW_param4", tvbrange, value)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_DO_SET_MODE
function payload_fns.payload_39_cmd176(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param1, tvbrange, value)
    dissect_flags_MAV_MODE_FLAG(subtree, "cmd_MAV_CMD_DO_SET_MODE_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_DO_FLIGHTTERMINATION
function payload_fns.payload_39_cmd185(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_FLIGHTTERMINATION_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_DO_REPOSITION
function payload_fns.payload_39_cmd192(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param2, tvbrange, value)
    dissect_flags_MAV_DO_REPOSITION_FLAGS(subtree, "cmd_MAV_CMD_DO_REPOSITION_param2", tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param7, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_DO_PAUSE_CONTINUE
function payload_fns.payload_39_cmd193(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_PREFLIGHT_STORAGE
function payload_fns.payload_39_cmd245(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
function payload_fns.payload_39_cmd246(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param3, tvbrange, value)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param6, tvbrange, value)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_OVERRIDE_GOTO
function payload_fns.payload_39_cmd252(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param3, tvbrange, value)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param7, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_MISSION_START
function payload_fns.payload_39_cmd300(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_MISSION_START_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_MISSION_START_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_COMPONENT_ARM_DISARM
function payload_fns.payload_39_cmd400(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_GET_HOME_POSITION
function payload_fns.payload_39_cmd410(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_REQUEST_MESSAGE
function payload_fns.payload_39_cmd512(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param7, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES
function payload_fns.payload_39_cmd520(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_USER_1
function payload_fns.payload_39_cmd31010(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_USER_2
function payload_fns.payload_39_cmd31011(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM with command MAV_CMD_ENUM_END
function payload_fns.payload_39_cmd31012(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM
function payload_fns.payload_39(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    local cmd_id = padded(offset + 30, 2):le_uint()
    local cmd_name = enumEntryName.MAV_CMD[cmd_id]
    if cmd_name ~= nil then
        pinfo.cols.info:append(": " .. cmd_name)
    end
    local cmd_fn = payload_fns["payload_39_cmd" .. tostring(cmd_id)]
    if cmd_fn ~= nil then
        cmd_fn(buffer, tree, msgid, offset, limit, pinfo)
        return
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_REQUEST
function payload_fns.payload_40(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 5 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 5)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.MISSION_REQUEST_target_system, tvbrange)
    tvbrange = padded(offset + 3, 1)
    subtree = tree:add_le(f.MISSION_REQUEST_target_component, tvbrange)
    tvbrange = padded(offset + 0, 2)
    subtree = tree:add_le(f.MISSION_REQUEST_seq, tvbrange)
    tvbrange = padded(offset + 4, 1)
    subtree = tree:add_le(f.MISSION_REQUEST_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_SET_CURRENT
function payload_fns.payload_41(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 4 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 4)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.MISSION_SET_CURRENT_target_system, tvbrange)
    tvbrange = padded(offset + 3, 1)
    subtree = tree:add_le(f.MISSION_SET_CURRENT_target_component, tvbrange)
    tvbrange = padded(offset + 0, 2)
    subtree = tree:add_le(f.MISSION_SET_CURRENT_seq, tvbrange)
end
-- dissect payload of message type MISSION_CURRENT
function payload_fns.payload_42(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 6 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 6)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 2)
    subtree = tree:add_le(f.MISSION_CURRENT_seq, tvbrange)
    tvbrange = padded(offset + 2, 2)
    subtree = tree:add_le(f.MISSION_CURRENT_total, tvbrange)
    tvbrange = padded(offset + 4, 1)
    subtree = tree:add_le(f.MISSION_CURRENT_mission_state, tvbrange)
    tvbrange = padded(offset + 5, 1)
    subtree = tree:add_le(f.MISSION_CURRENT_mission_mode, tvbrange)
end
-- dissect payload of message type MISSION_REQUEST_LIST
function payload_fns.payload_43(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 3 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 3)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 1)
    subtree = tree:add_le(f.MISSION_REQUEST_LIST_target_system, tvbrange)
    tvbrange = padded(offset + 1, 1)
    subtree = tree:add_le(f.MISSION_REQUEST_LIST_target_component, tvbrange)
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.MISSION_REQUEST_LIST_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_COUNT
function payload_fns.payload_44(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 5 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 5)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.MISSION_COUNT_target_system, tvbrange)
    tvbrange = padded(offset + 3, 1)
    subtree = tree:add_le(f.MISSION_COUNT_target_component, tvbrange)
    tvbrange = padded(offset + 0, 2)
    subtree = tree:add_le(f.MISSION_COUNT_count, tvbrange)
    tvbrange = padded(offset + 4, 1)
    subtree = tree:add_le(f.MISSION_COUNT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_CLEAR_ALL
function payload_fns.payload_45(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 3 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 3)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 1)
    subtree = tree:add_le(f.MISSION_CLEAR_ALL_target_system, tvbrange)
    tvbrange = padded(offset + 1, 1)
    subtree = tree:add_le(f.MISSION_CLEAR_ALL_target_component, tvbrange)
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.MISSION_CLEAR_ALL_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_REACHED
function payload_fns.payload_46(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 2 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 2)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 2)
    subtree = tree:add_le(f.MISSION_ITEM_REACHED_seq, tvbrange)
end
-- dissect payload of message type MISSION_ACK
function payload_fns.payload_47(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 4 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 4)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 1)
    subtree = tree:add_le(f.MISSION_ACK_target_system, tvbrange)
    tvbrange = padded(offset + 1, 1)
    subtree = tree:add_le(f.MISSION_ACK_target_component, tvbrange)
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.MISSION_ACK_type, tvbrange)
    tvbrange = padded(offset + 3, 1)
    subtree = tree:add_le(f.MISSION_ACK_mission_type, tvbrange)
end
-- dissect payload of message type GPS_GLOBAL_ORIGIN
function payload_fns.payload_49(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 20 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 20)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.GPS_GLOBAL_ORIGIN_latitude, tvbrange)
    value = tvbrange:le_int()
    subtree:append_text(string.format(" (%.7f deg)",value/1E7))
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.GPS_GLOBAL_ORIGIN_longitude, tvbrange)
    value = tvbrange:le_int()
    subtree:append_text(string.format(" (%.7f deg)",value/1E7))
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.GPS_GLOBAL_ORIGIN_altitude, tvbrange)
    tvbrange = padded(offset + 12, 8)
    subtree = tree:add_le(f.GPS_GLOBAL_ORIGIN_time_usec, tvbrange)
    value = tvbrange:le_uint64()
    subtree:append_text(time_usec_decode(value))
end
-- dissect payload of message type MISSION_REQUEST_INT
function payload_fns.payload_51(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 5 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 5)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.MISSION_REQUEST_INT_target_system, tvbrange)
    tvbrange = padded(offset + 3, 1)
    subtree = tree:add_le(f.MISSION_REQUEST_INT_target_component, tvbrange)
    tvbrange = padded(offset + 0, 2)
    subtree = tree:add_le(f.MISSION_REQUEST_INT_seq, tvbrange)
    tvbrange = padded(offset + 4, 1)
    subtree = tree:add_le(f.MISSION_REQUEST_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_NAV_RETURN_TO_LAUNCH
function payload_fns.payload_73_cmd20(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_CONDITION_YAW
function payload_fns.payload_73_cmd115(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param4, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_CONDITION_YAW_param4", tvbrange, value)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_DO_SET_MODE
function payload_fns.payload_73_cmd176(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param1, tvbrange, value)
    dissect_flags_MAV_MODE_FLAG(subtree, "cmd_MAV_CMD_DO_SET_MODE_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_DO_FLIGHTTERMINATION
function payload_fns.payload_73_cmd185(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_FLIGHTTERMINATION_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_DO_REPOSITION
function payload_fns.payload_73_cmd192(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param2, tvbrange, value)
    dissect_flags_MAV_DO_REPOSITION_FLAGS(subtree, "cmd_MAV_CMD_DO_REPOSITION_param2", tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_DO_PAUSE_CONTINUE
function payload_fns.payload_73_cmd193(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_PREFLIGHT_STORAGE
function payload_fns.payload_73_cmd245(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
function payload_fns.payload_73_cmd246(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param3, tvbrange, value)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    value = tvbrange:le_int()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_y, tvbrange, value)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_OVERRIDE_GOTO
function payload_fns.payload_73_cmd252(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param3, tvbrange, value)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_MISSION_START
function payload_fns.payload_73_cmd300(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_MISSION_START_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_MISSION_START_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_COMPONENT_ARM_DISARM
function payload_fns.payload_73_cmd400(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_GET_HOME_POSITION
function payload_fns.payload_73_cmd410(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_REQUEST_MESSAGE
function payload_fns.payload_73_cmd512(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES
function payload_fns.payload_73_cmd520(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_USER_1
function payload_fns.payload_73_cmd31010(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_USER_2
function payload_fns.payload_73_cmd31011(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT with command MAV_CMD_ENUM_END
function payload_fns.payload_73_cmd31012(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type MISSION_ITEM_INT
function payload_fns.payload_73(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 38 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 38)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    local cmd_id = padded(offset + 30, 2):le_uint()
    local cmd_name = enumEntryName.MAV_CMD[cmd_id]
    if cmd_name ~= nil then
        pinfo.cols.info:append(": " .. cmd_name)
    end
    local cmd_fn = payload_fns["payload_73_cmd" .. tostring(cmd_id)]
    if cmd_fn ~= nil then
        cmd_fn(buffer, tree, msgid, offset, limit, pinfo)
        return
    end
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_system, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_seq, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_frame, tvbrange)
    tvbrange = padded(offset + 30, 2)
    subtree = tree:add_le(f.MISSION_ITEM_INT_command, tvbrange)
    tvbrange = padded(offset + 35, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_current, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.MISSION_ITEM_INT_z, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.MISSION_ITEM_INT_mission_type, tvbrange)
end
-- dissect payload of message type VFR_HUD
function payload_fns.payload_74(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 20 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 20)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.VFR_HUD_airspeed, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.VFR_HUD_groundspeed, tvbrange)
    tvbrange = padded(offset + 16, 2)
    subtree = tree:add_le(f.VFR_HUD_heading, tvbrange)
    tvbrange = padded(offset + 18, 2)
    subtree = tree:add_le(f.VFR_HUD_throttle, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.VFR_HUD_alt, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.VFR_HUD_climb, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_NAV_RETURN_TO_LAUNCH
function payload_fns.payload_75_cmd20(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_CONDITION_YAW
function payload_fns.payload_75_cmd115(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param4, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_CONDITION_YAW_param4", tvbrange, value)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_DO_SET_MODE
function payload_fns.payload_75_cmd176(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param1, tvbrange, value)
    dissect_flags_MAV_MODE_FLAG(subtree, "cmd_MAV_CMD_DO_SET_MODE_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_DO_FLIGHTTERMINATION
function payload_fns.payload_75_cmd185(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_FLIGHTTERMINATION_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_DO_REPOSITION
function payload_fns.payload_75_cmd192(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param2, tvbrange, value)
    dissect_flags_MAV_DO_REPOSITION_FLAGS(subtree, "cmd_MAV_CMD_DO_REPOSITION_param2", tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_DO_PAUSE_CONTINUE
function payload_fns.payload_75_cmd193(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_PREFLIGHT_STORAGE
function payload_fns.payload_75_cmd245(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
function payload_fns.payload_75_cmd246(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param3, tvbrange, value)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    value = tvbrange:le_int()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_y, tvbrange, value)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_OVERRIDE_GOTO
function payload_fns.payload_75_cmd252(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param3, tvbrange, value)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_MISSION_START
function payload_fns.payload_75_cmd300(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_MISSION_START_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_MISSION_START_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_COMPONENT_ARM_DISARM
function payload_fns.payload_75_cmd400(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_GET_HOME_POSITION
function payload_fns.payload_75_cmd410(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_REQUEST_MESSAGE
function payload_fns.payload_75_cmd512(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES
function payload_fns.payload_75_cmd520(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_USER_1
function payload_fns.payload_75_cmd31010(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_USER_2
function payload_fns.payload_75_cmd31011(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT with command MAV_CMD_ENUM_END
function payload_fns.payload_75_cmd31012(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_INT
function payload_fns.payload_75(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 35 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 35)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    local cmd_id = padded(offset + 28, 2):le_uint()
    local cmd_name = enumEntryName.MAV_CMD[cmd_id]
    if cmd_name ~= nil then
        pinfo.cols.info:append(": " .. cmd_name)
    end
    local cmd_fn = payload_fns["payload_75_cmd" .. tostring(cmd_id)]
    if cmd_fn ~= nil then
        cmd_fn(buffer, tree, msgid, offset, limit, pinfo)
        return
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_INT_target_component, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_INT_frame, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_INT_command, tvbrange)
    tvbrange = padded(offset + 33, 1)
    subtree = tree:add_le(f.COMMAND_INT_current, tvbrange)
    tvbrange = padded(offset + 34, 1)
    subtree = tree:add_le(f.COMMAND_INT_autocontinue, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_INT_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_INT_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_INT_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_INT_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_INT_x, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_INT_y, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_INT_z, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_NAV_RETURN_TO_LAUNCH
function payload_fns.payload_76_cmd20(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_CONDITION_YAW
function payload_fns.payload_76_cmd115(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_CONDITION_YAW_param4, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_CONDITION_YAW_param4", tvbrange, value)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_DO_SET_MODE
function payload_fns.payload_76_cmd176(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param1, tvbrange, value)
    dissect_flags_MAV_MODE_FLAG(subtree, "cmd_MAV_CMD_DO_SET_MODE_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_SET_MODE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_DO_FLIGHTTERMINATION
function payload_fns.payload_76_cmd185(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_FLIGHTTERMINATION_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_DO_REPOSITION
function payload_fns.payload_76_cmd192(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param2, tvbrange, value)
    dissect_flags_MAV_DO_REPOSITION_FLAGS(subtree, "cmd_MAV_CMD_DO_REPOSITION_param2", tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_REPOSITION_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_DO_PAUSE_CONTINUE
function payload_fns.payload_76_cmd193(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_DO_PAUSE_CONTINUE_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_PREFLIGHT_STORAGE
function payload_fns.payload_76_cmd245(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_STORAGE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
function payload_fns.payload_76_cmd246(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param3, tvbrange, value)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN_param6, tvbrange, value)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_OVERRIDE_GOTO
function payload_fns.payload_76_cmd252(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param1, tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param2, tvbrange, value)
    tvbrange = padded(offset + 8, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param3, tvbrange, value)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_OVERRIDE_GOTO_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_MISSION_START
function payload_fns.payload_76_cmd300(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_MISSION_START_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_MISSION_START_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_COMPONENT_ARM_DISARM
function payload_fns.payload_76_cmd400(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_COMPONENT_ARM_DISARM_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_COMPONENT_ARM_DISARM_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_GET_HOME_POSITION
function payload_fns.payload_76_cmd410(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_REQUEST_MESSAGE
function payload_fns.payload_76_cmd512(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_MESSAGE_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES
function payload_fns.payload_76_cmd520(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    value = tvbrange:le_float()
    subtree = tree:add_le(f.cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1, tvbrange, value)
    dissect_flags_MAV_BOOL(subtree, "cmd_MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES_param1", tvbrange, value)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_USER_1
function payload_fns.payload_76_cmd31010(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_USER_2
function payload_fns.payload_76_cmd31011(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG with command MAV_CMD_ENUM_END
function payload_fns.payload_76_cmd31012(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_LONG
function payload_fns.payload_76(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 33 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 33)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    local cmd_id = padded(offset + 28, 2):le_uint()
    local cmd_name = enumEntryName.MAV_CMD[cmd_id]
    if cmd_name ~= nil then
        pinfo.cols.info:append(": " .. cmd_name)
    end
    local cmd_fn = payload_fns["payload_76_cmd" .. tostring(cmd_id)]
    if cmd_fn ~= nil then
        cmd_fn(buffer, tree, msgid, offset, limit, pinfo)
        return
    end
    tvbrange = padded(offset + 30, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_system, tvbrange)
    tvbrange = padded(offset + 31, 1)
    subtree = tree:add_le(f.COMMAND_LONG_target_component, tvbrange)
    tvbrange = padded(offset + 28, 2)
    subtree = tree:add_le(f.COMMAND_LONG_command, tvbrange)
    tvbrange = padded(offset + 32, 1)
    subtree = tree:add_le(f.COMMAND_LONG_confirmation, tvbrange)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param1, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param2, tvbrange)
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param3, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param4, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param5, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param6, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.COMMAND_LONG_param7, tvbrange)
end
-- dissect payload of message type COMMAND_ACK
function payload_fns.payload_77(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 10 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 10)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    local cmd_id = padded(offset + 0, 2):le_uint()
    local cmd_name = enumEntryName.MAV_CMD[cmd_id]
    if cmd_name ~= nil then
        pinfo.cols.info:append(": " .. cmd_name)
    end
    tvbrange = padded(offset + 0, 2)
    subtree = tree:add_le(f.COMMAND_ACK_command, tvbrange)
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.COMMAND_ACK_result, tvbrange)
    tvbrange = padded(offset + 3, 1)
    subtree = tree:add_le(f.COMMAND_ACK_progress, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.COMMAND_ACK_result_param2, tvbrange)
    tvbrange = padded(offset + 8, 1)
    subtree = tree:add_le(f.COMMAND_ACK_target_system, tvbrange)
    tvbrange = padded(offset + 9, 1)
    subtree = tree:add_le(f.COMMAND_ACK_target_component, tvbrange)
end
-- dissect payload of message type HOME_POSITION
function payload_fns.payload_242(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 60 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 60)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.HOME_POSITION_latitude, tvbrange)
    value = tvbrange:le_int()
    subtree:append_text(string.format(" (%.7f deg)",value/1E7))
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.HOME_POSITION_longitude, tvbrange)
    value = tvbrange:le_int()
    subtree:append_text(string.format(" (%.7f deg)",value/1E7))
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.HOME_POSITION_altitude, tvbrange)
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.HOME_POSITION_x, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.HOME_POSITION_y, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.HOME_POSITION_z, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.HOME_POSITION_q_0, tvbrange)
    tvbrange = padded(offset + 28, 4)
    subtree = tree:add_le(f.HOME_POSITION_q_1, tvbrange)
    tvbrange = padded(offset + 32, 4)
    subtree = tree:add_le(f.HOME_POSITION_q_2, tvbrange)
    tvbrange = padded(offset + 36, 4)
    subtree = tree:add_le(f.HOME_POSITION_q_3, tvbrange)
    tvbrange = padded(offset + 40, 4)
    subtree = tree:add_le(f.HOME_POSITION_approach_x, tvbrange)
    tvbrange = padded(offset + 44, 4)
    subtree = tree:add_le(f.HOME_POSITION_approach_y, tvbrange)
    tvbrange = padded(offset + 48, 4)
    subtree = tree:add_le(f.HOME_POSITION_approach_z, tvbrange)
    tvbrange = padded(offset + 52, 8)
    subtree = tree:add_le(f.HOME_POSITION_time_usec, tvbrange)
    value = tvbrange:le_uint64()
    subtree:append_text(time_usec_decode(value))
end
-- dissect payload of message type STATUSTEXT
function payload_fns.payload_253(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 54 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 54)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 1)
    subtree = tree:add_le(f.STATUSTEXT_severity, tvbrange)
    tvbrange = padded(offset + 1, 50)
    subtree = tree:add_le(f.STATUSTEXT_text, tvbrange)
    tvbrange = padded(offset + 51, 2)
    subtree = tree:add_le(f.STATUSTEXT_id, tvbrange)
    tvbrange = padded(offset + 53, 1)
    subtree = tree:add_le(f.STATUSTEXT_chunk_seq, tvbrange)
end
-- dissect payload of message type PARAM_ERROR
function payload_fns.payload_345(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 21 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 21)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 2, 1)
    subtree = tree:add_le(f.PARAM_ERROR_target_system, tvbrange)
    tvbrange = padded(offset + 3, 1)
    subtree = tree:add_le(f.PARAM_ERROR_target_component, tvbrange)
    tvbrange = padded(offset + 4, 16)
    subtree = tree:add_le(f.PARAM_ERROR_param_id, tvbrange)
    tvbrange = padded(offset + 0, 2)
    subtree = tree:add_le(f.PARAM_ERROR_param_index, tvbrange)
    tvbrange = padded(offset + 20, 1)
    subtree = tree:add_le(f.PARAM_ERROR_error, tvbrange)
end
-- dissect payload of message type GLOBAL_POSITION_INT
function payload_fns.payload_33(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 28 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 28)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.GLOBAL_POSITION_INT_time_boot_ms, tvbrange)
    tvbrange = padded(offset + 4, 4)
    subtree = tree:add_le(f.GLOBAL_POSITION_INT_lat, tvbrange)
    value = tvbrange:le_int()
    subtree:append_text(string.format(" (%.7f deg)",value/1E7))
    tvbrange = padded(offset + 8, 4)
    subtree = tree:add_le(f.GLOBAL_POSITION_INT_lon, tvbrange)
    value = tvbrange:le_int()
    subtree:append_text(string.format(" (%.7f deg)",value/1E7))
    tvbrange = padded(offset + 12, 4)
    subtree = tree:add_le(f.GLOBAL_POSITION_INT_alt, tvbrange)
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.GLOBAL_POSITION_INT_relative_alt, tvbrange)
    tvbrange = padded(offset + 20, 2)
    subtree = tree:add_le(f.GLOBAL_POSITION_INT_vx, tvbrange)
    tvbrange = padded(offset + 22, 2)
    subtree = tree:add_le(f.GLOBAL_POSITION_INT_vy, tvbrange)
    tvbrange = padded(offset + 24, 2)
    subtree = tree:add_le(f.GLOBAL_POSITION_INT_vz, tvbrange)
    tvbrange = padded(offset + 26, 2)
    subtree = tree:add_le(f.GLOBAL_POSITION_INT_hdg, tvbrange)
end
-- dissect payload of message type AUTOPILOT_VERSION
function payload_fns.payload_148(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 78 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 78)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 0, 8)
    value = tvbrange:le_uint64()
    subtree = tree:add_le(f.AUTOPILOT_VERSION_capabilities, tvbrange, value)
    dissect_flags_MAV_PROTOCOL_CAPABILITY(subtree, "AUTOPILOT_VERSION_capabilities", tvbrange, value:tonumber())
    tvbrange = padded(offset + 16, 4)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_flight_sw_version, tvbrange)
    tvbrange = padded(offset + 20, 4)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_middleware_sw_version, tvbrange)
    tvbrange = padded(offset + 24, 4)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_os_sw_version, tvbrange)
    tvbrange = padded(offset + 28, 4)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_board_version, tvbrange)
    tvbrange = padded(offset + 36, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_flight_custom_version_0, tvbrange)
    tvbrange = padded(offset + 37, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_flight_custom_version_1, tvbrange)
    tvbrange = padded(offset + 38, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_flight_custom_version_2, tvbrange)
    tvbrange = padded(offset + 39, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_flight_custom_version_3, tvbrange)
    tvbrange = padded(offset + 40, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_flight_custom_version_4, tvbrange)
    tvbrange = padded(offset + 41, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_flight_custom_version_5, tvbrange)
    tvbrange = padded(offset + 42, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_flight_custom_version_6, tvbrange)
    tvbrange = padded(offset + 43, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_flight_custom_version_7, tvbrange)
    tvbrange = padded(offset + 44, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_middleware_custom_version_0, tvbrange)
    tvbrange = padded(offset + 45, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_middleware_custom_version_1, tvbrange)
    tvbrange = padded(offset + 46, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_middleware_custom_version_2, tvbrange)
    tvbrange = padded(offset + 47, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_middleware_custom_version_3, tvbrange)
    tvbrange = padded(offset + 48, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_middleware_custom_version_4, tvbrange)
    tvbrange = padded(offset + 49, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_middleware_custom_version_5, tvbrange)
    tvbrange = padded(offset + 50, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_middleware_custom_version_6, tvbrange)
    tvbrange = padded(offset + 51, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_middleware_custom_version_7, tvbrange)
    tvbrange = padded(offset + 52, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_os_custom_version_0, tvbrange)
    tvbrange = padded(offset + 53, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_os_custom_version_1, tvbrange)
    tvbrange = padded(offset + 54, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_os_custom_version_2, tvbrange)
    tvbrange = padded(offset + 55, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_os_custom_version_3, tvbrange)
    tvbrange = padded(offset + 56, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_os_custom_version_4, tvbrange)
    tvbrange = padded(offset + 57, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_os_custom_version_5, tvbrange)
    tvbrange = padded(offset + 58, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_os_custom_version_6, tvbrange)
    tvbrange = padded(offset + 59, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_os_custom_version_7, tvbrange)
    tvbrange = padded(offset + 32, 2)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_vendor_id, tvbrange)
    tvbrange = padded(offset + 34, 2)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_product_id, tvbrange)
    tvbrange = padded(offset + 8, 8)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid, tvbrange)
    tvbrange = padded(offset + 60, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_0, tvbrange)
    tvbrange = padded(offset + 61, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_1, tvbrange)
    tvbrange = padded(offset + 62, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_2, tvbrange)
    tvbrange = padded(offset + 63, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_3, tvbrange)
    tvbrange = padded(offset + 64, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_4, tvbrange)
    tvbrange = padded(offset + 65, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_5, tvbrange)
    tvbrange = padded(offset + 66, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_6, tvbrange)
    tvbrange = padded(offset + 67, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_7, tvbrange)
    tvbrange = padded(offset + 68, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_8, tvbrange)
    tvbrange = padded(offset + 69, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_9, tvbrange)
    tvbrange = padded(offset + 70, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_10, tvbrange)
    tvbrange = padded(offset + 71, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_11, tvbrange)
    tvbrange = padded(offset + 72, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_12, tvbrange)
    tvbrange = padded(offset + 73, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_13, tvbrange)
    tvbrange = padded(offset + 74, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_14, tvbrange)
    tvbrange = padded(offset + 75, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_15, tvbrange)
    tvbrange = padded(offset + 76, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_16, tvbrange)
    tvbrange = padded(offset + 77, 1)
    subtree = tree:add_le(f.AUTOPILOT_VERSION_uid2_17, tvbrange)
end
-- dissect payload of message type HEARTBEAT
function payload_fns.payload_0(buffer, tree, msgid, offset, limit, pinfo)
    local padded, field_offset, value, subtree, tvbrange
    if (offset + 9 > limit) then
        padded = buffer(0, limit):bytes()
        padded:set_size(offset + 9)
        padded = padded:tvb("Untruncated payload")
    else
        padded = buffer
    end
    tvbrange = padded(offset + 4, 1)
    subtree = tree:add_le(f.HEARTBEAT_type, tvbrange)
    tvbrange = padded(offset + 5, 1)
    subtree = tree:add_le(f.HEARTBEAT_autopilot, tvbrange)
    tvbrange = padded(offset + 6, 1)
    subtree = tree:add_le(f.HEARTBEAT_base_mode, tvbrange)
    value = tvbrange:le_uint()
    dissect_flags_MAV_MODE_FLAG(subtree, "HEARTBEAT_base_mode", tvbrange, value)
    tvbrange = padded(offset + 0, 4)
    subtree = tree:add_le(f.HEARTBEAT_custom_mode, tvbrange)
    tvbrange = padded(offset + 7, 1)
    subtree = tree:add_le(f.HEARTBEAT_system_status, tvbrange)
    tvbrange = padded(offset + 8, 1)
    subtree = tree:add_le(f.HEARTBEAT_mavlink_version, tvbrange)
end
-- dissector function
function mavlink_proto.dissector(buffer,pinfo,tree)
    local offset = 0
    local msgCount = 0

    -- loop through the buffer to extract all the messages in the buffer
    while (offset < buffer:len())
    do
        msgCount = msgCount + 1
        local subtree = tree:add (mavlink_proto, buffer(), "MAVLink Protocol ("..buffer:len()..")")

        -- decode protocol version first
        local version = buffer(offset,1):uint()
        local protocolString = ""

        while (true)
        do
            protocolString = protocolVersions[version]
            if (protocolString ~= nil) then
                break
            else
                protocolString = "unknown"
                -- some unknown data found, record the begin offset
                if (unknownFrameBeginOffset == 0) then
                    unknownFrameBeginOffset = offset
                end

                offset = offset + 1

                if (offset < buffer:len()) then
                    version = buffer(offset,1):uint()
                else
                    -- no magic value found in the whole buffer. print the raw data and exit
                    if (unknownFrameBeginOffset ~= 0) then
                        if (msgCount == 1) then
                            pinfo.cols.info:set("Unknown message")
                        else
                            pinfo.cols.info:append("  Unknown message")
                        end
                        size = offset - unknownFrameBeginOffset
                        subtree:add(f.rawpayload, buffer(unknownFrameBeginOffset,size))
                        unknownFrameBeginOffset = 0
                    end
                    return
                end
            end
        end

        if (unknownFrameBeginOffset ~= 0) then
            pinfo.cols.info:append("Unknown message")
            size = offset - unknownFrameBeginOffset
            subtree:add(f.rawpayload, buffer(unknownFrameBeginOffset,size))
            unknownFrameBeginOffset = 0
            -- jump to next loop
            break
        end

        -- some Wireshark decoration
        pinfo.cols.protocol = protocolString

        -- HEADER ----------------------------------------

        local msgid
        local length
        local incompatibility_flag

        if (version == 0xfe) then
            if (buffer:len() - 2 - offset > 6) then
                -- normal header
                local header = subtree:add(buffer(offset, 6), "Header")
                header:add(f.magic, buffer(offset,1), version)
                offset = offset + 1

                length = buffer(offset,1)
                header:add(f.length, length)
                offset = offset + 1

                local sequence = buffer(offset,1)
                header:add(f.sequence, sequence)
                offset = offset + 1

                local sysid = buffer(offset,1)
                header:add(f.sysid, sysid)
                offset = offset + 1

                local compid = buffer(offset,1)
                header:add(f.compid, compid)
                offset = offset + 1

                pinfo.cols.src = "System: "..tostring(sysid:uint())..', Component: '..tostring(compid:uint())

                msgid = buffer(offset,1):uint()
                header:add(f.msgid, buffer(offset,1), msgid)
                offset = offset + 1
            else
                -- handle truncated header
                local hsize = buffer:len() - 2 - offset
                subtree:add(f.rawheader, buffer(offset, hsize))
                offset = offset + hsize
            end
        elseif (version == 0xfd) then
            if (buffer:len() - 2 - offset > 10) then
                -- normal header
                local header = subtree:add(buffer(offset, 10), "Header")
                header:add(f.magic, buffer(offset,1), version)
                offset = offset + 1
                length = buffer(offset,1)
                header:add(f.length, length)
                offset = offset + 1
                incompatibility_flag = buffer(offset,1):uint()
                header:add(f.incompatibility_flag, buffer(offset,1), incompatibility_flag)
                offset = offset + 1
                local compatibility_flag = buffer(offset,1)
                header:add(f.compatibility_flag, compatibility_flag)
                offset = offset + 1
                local sequence = buffer(offset,1)
                header:add(f.sequence, sequence)
                offset = offset + 1
                local sysid = buffer(offset,1)
                header:add(f.sysid, sysid)
                offset = offset + 1
                local compid = buffer(offset,1)
                header:add(f.compid, compid)
                offset = offset + 1
                pinfo.cols.src = "System: "..tostring(sysid:uint())..', Component: '..tostring(compid:uint())
                msgid = buffer(offset,3):le_uint()
                header:add(f.msgid, buffer(offset,3), msgid)
                offset = offset + 3
            else
                -- handle truncated header
                local hsize = buffer:len() - 2 - offset
                subtree:add(f.rawheader, buffer(offset, hsize))
                offset = offset + hsize
            end
        end


        -- BODY ----------------------------------------

        -- dynamically call the type-specific payload dissector
        local msgnr = msgid
        local dissect_payload_fn = "payload_"..tostring(msgnr)
        local fn = payload_fns[dissect_payload_fn]
        local limit = buffer:len() - 2

        if (length) then
            length = length:uint()
        else
            length = 0
        end

        if (offset + length < limit) then
            limit = offset + length
        end

        if (fn == nil) then
            pinfo.cols.info:append ("Unknown message type   ")
            subtree:add_expert_info(PI_MALFORMED, PI_ERROR, "Unknown message type")
            size = buffer:len() - 2 - offset
            subtree:add(f.rawpayload, buffer(offset,size))
            offset = offset + size
        else
            local payload = subtree:add(f.payload, buffer(offset, limit - offset), msgid)
            pinfo.cols.dst:set(messageName[msgid])
            if (msgCount == 1) then
            -- first message should over write the TCP/UDP info
                pinfo.cols.info = messageName[msgid]
            else
                pinfo.cols.info:append("   "..messageName[msgid])
            end
            fn(buffer, payload, msgid, offset, limit, pinfo)
            offset = limit
        end

        -- CRC ----------------------------------------

        local crc = buffer(offset,2)
        subtree:add_le(f.crc, crc)
        offset = offset + 2

        -- SIGNATURE ----------------------------------

        if (version == 0xfd and bit.band(incompatibility_flag, 0x01) ~= 0) then
            if (offset + 13 <= buffer:len()) then
                local signature = subtree:add("Signature")

                local link = buffer(offset,1)
                signature:add(f.signature_link, link)
                offset = offset + 1

                local signature_time = buffer(offset,6):le_uint64()
                local time_secs = signature_time / 100000
                local time_nsecs = (signature_time - (time_secs * 100000)) * 10000
                signature:add(f.signature_time, buffer(offset,6), NSTime.new(signature_time_ref + time_secs:tonumber(), time_nsecs:tonumber()))
                offset = offset + 6

                local signature_signature = buffer(offset,6)
                signature:add(f.signature_signature, signature_signature)
                offset = offset + 6
            end
        end

    end
end

-- The link's datagrams.
local KINDS = {[1] = "MAVLINK", [2] = "BULK_CHUNK", [3] = "BULK_BITMAP", [4] = "TELECOMMAND", [5] = "REPORT"}
local COMMANDS = {[1] = "goto", [2] = "stop", [3] = "safe", [4] = "resume", [5] = "status", [6] = "get", [7] = "emergency_stop", [8] = "reset", [9] = "scan", [10] = "turn", [11] = "drive", [12] = "mission", [13] = "map_clear", [14] = "faults_list", [15] = "faults_clear", [16] = "faults_mask", [17] = "time", [18] = "reboot", [19] = "param_list", [20] = "param_get", [21] = "param_set", [22] = "param_save", [23] = "fence_add", [24] = "fence_clear", [25] = "fence_list", [26] = "return", [27] = "sequence_upload", [28] = "sequence_clear", [29] = "sequence_check", [30] = "sequence_run", [31] = "sequence_abort", [40] = "lease_ask", [41] = "lease_release", [42] = "lease_show", [43] = "contacts_set", [44] = "contacts_clear", [45] = "keys_rotate"}
local STATES = {[0] = "REQUESTED", [1] = "RECEIVED", [2] = "ACCEPTED", [3] = "STARTED", [4] = "PROGRESS", [5] = "COMPLETED", [6] = "FAILED", [7] = "EXPIRED", [8] = "CANCELLED"}
local CODES = {[0] = "NONE", [1] = "UNKNOWN_COMMAND", [2] = "RANGE", [3] = "MODE", [4] = "REUSED_ID", [5] = "FORGOTTEN_ID", [6] = "TOO_MANY", [7] = "VERSION", [8] = "LEASE", [9] = "RESTARTED", [10] = "OVERTAKEN"}
local TAG_BYTES, ANNOUNCEMENT = 16, 65535
local DOWNLINK_KEY_ID = 0
local F = {}
F["header.kind"] = ProtoField.uint8("eldorado.header.kind", "kind", base.DEC, KINDS)
F["header.key_id"] = ProtoField.uint8("eldorado.header.key_id", "key id")
F["header.epoch"] = ProtoField.uint8("eldorado.header.epoch", "epoch")
F["header.flags"] = ProtoField.uint8("eldorado.header.flags", "flags")
F["header.counter"] = ProtoField.uint64("eldorado.header.counter", "counter")
F["header.boot_id"] = ProtoField.uint32("eldorado.header.boot_id", "boot id")
F["telecommand.request_id"] = ProtoField.uint32("eldorado.telecommand.request_id", "request id")
F["telecommand.issued_ns"] = ProtoField.int64("eldorado.telecommand.issued_ns", "issued ns")
F["telecommand.expiry_ns"] = ProtoField.int64("eldorado.telecommand.expiry_ns", "expiry ns")
F["telecommand.start_ns"] = ProtoField.int64("eldorado.telecommand.start_ns", "start ns")
F["telecommand.command"] = ProtoField.uint8("eldorado.telecommand.command", "command", base.DEC, COMMANDS)
F["report.request_id"] = ProtoField.uint32("eldorado.report.request_id", "request id")
F["report.station"] = ProtoField.uint8("eldorado.report.station", "station")
F["report.serial"] = ProtoField.uint8("eldorado.report.serial", "serial")
F["report.state"] = ProtoField.uint8("eldorado.report.state", "state", base.DEC, STATES)
F["report.code"] = ProtoField.uint8("eldorado.report.code", "code", base.DEC, CODES)
F["report.values"] = ProtoField.uint8("eldorado.report.values", "values")
F["chunk.object_id"] = ProtoField.uint32("eldorado.chunk.object_id", "object id")
F["chunk.serial"] = ProtoField.uint32("eldorado.chunk.serial", "serial")
F["chunk.index"] = ProtoField.uint16("eldorado.chunk.index", "index")
F["announcement.length"] = ProtoField.uint32("eldorado.announcement.length", "length")
F["announcement.chunk_size"] = ProtoField.uint16("eldorado.announcement.chunk_size", "chunk size")
F["announcement.sha256"] = ProtoField.bytes("eldorado.announcement.sha256", "sha256", base.NONE)
F["announcement.name_length"] = ProtoField.uint8("eldorado.announcement.name_length", "name length")
F["announcement.codec_length"] = ProtoField.uint8("eldorado.announcement.codec_length", "codec length")
F["bitmap.object_id"] = ProtoField.uint32("eldorado.bitmap.object_id", "object id")
F["bitmap.echo"] = ProtoField.uint32("eldorado.bitmap.echo", "echo")
F["bitmap.flags"] = ProtoField.uint8("eldorado.bitmap.flags", "flags")
F["bitmap.base"] = ProtoField.uint16("eldorado.bitmap.base", "base")
F["acknowledgement.base"] = ProtoField.uint32("eldorado.acknowledgement.base", "base")
local READ = {
    header = {{F["header.kind"], 1}, {F["header.key_id"], 1}, {F["header.epoch"], 1}, {F["header.flags"], 1}, {F["header.counter"], 8}, {F["header.boot_id"], 4}},
    telecommand = {{F["telecommand.request_id"], 4}, {F["telecommand.issued_ns"], 8}, {F["telecommand.expiry_ns"], 8}, {F["telecommand.start_ns"], 8}, {F["telecommand.command"], 1}},
    report = {{F["report.request_id"], 4}, {F["report.station"], 1}, {F["report.serial"], 1}, {F["report.state"], 1}, {F["report.code"], 1}, {F["report.values"], 1}},
    chunk = {{F["chunk.object_id"], 4}, {F["chunk.serial"], 4}, {F["chunk.index"], 2}},
    announcement = {{F["announcement.length"], 4}, {F["announcement.chunk_size"], 2}, {F["announcement.sha256"], 32}, {F["announcement.name_length"], 1}, {F["announcement.codec_length"], 1}},
    bitmap = {{F["bitmap.object_id"], 4}, {F["bitmap.echo"], 4}, {F["bitmap.flags"], 1}, {F["bitmap.base"], 2}},
    acknowledgement = {{F["acknowledgement.base"], 4}},
}
local ARGUMENTS = {
    [1] = {{"x_m", "number", "m", {}}, {"y_m", "number", "m", {}}, {"heading_rad", "number", "rad", {}}},
    [6] = {{"product", "choice", "", {"ldem", "scan", "nsp", "record", "height_std"}}, {"from_s", "number", "s", {}}, {"to_s", "number", "s", {}}, {"channels", "choice", "", {"all", "slim"}}},
    [10] = {{"heading_rad", "number", "rad", {}}},
    [11] = {{"vx_mps", "number", "m/s", {}}, {"vy_mps", "number", "m/s", {}}, {"yaw_radps", "number", "rad/s", {}}, {"duration_s", "number", "s", {}}, {"distance_m", "number", "m", {}}},
    [12] = {{"goals_m", "points", "m", {}}},
    [15] = {{"fault", "text", "", {}}},
    [16] = {{"fault", "text", "", {}}, {"lasting_s", "number", "s", {}}},
    [20] = {{"parameter", "text", "", {}}},
    [21] = {{"parameter", "text", "", {}}, {"value", "text", "", {}}},
    [23] = {{"fence", "text", "", {}}, {"kind", "choice", "", {"keep_out", "goal"}}, {"corners_m", "points", "m", {}}},
    [24] = {{"fence", "text", "", {}}},
    [27] = {{"sequence", "text", "", {}}, {"number", "number", "", {}}, {"line", "text", "", {}}},
    [28] = {{"sequence", "text", "", {}}},
    [29] = {{"sequence", "text", "", {}}},
    [30] = {{"sequence", "text", "", {}}},
    [43] = {{"windows_s", "points", "s", {}}},
    [45] = {{"epoch", "number", "", {}}},
}

local link_proto = Proto("eldorado", "El Dorado link")
F.payload = ProtoField.bytes("eldorado.payload", "payload")
F.tag = ProtoField.bytes("eldorado.tag", "tag")
F.data = ProtoField.bytes("eldorado.data", "data")
F.bits = ProtoField.bytes("eldorado.bits", "bits from the base on")
F.value = ProtoField.double("eldorado.report.value", "value")
F.text = ProtoField.string("eldorado.report.text", "text", base.UNICODE)
F.name = ProtoField.string("eldorado.announcement.name", "name", base.UNICODE)
F.codec = ProtoField.string("eldorado.announcement.codec", "codec", base.UNICODE)
F.argument = ProtoField.string("eldorado.telecommand.argument", "argument", base.UNICODE)
F.bad = ProtoField.string("eldorado.bad", "malformed", base.UNICODE)
for _, field in pairs(F) do
    table.insert(link_proto.fields, field)
end

-- Each reader takes a buffer, the tree and where it begins, and gives where it ends; nil: the rest is too short.

local function struct(name, buffer, tree, at)
    local values = {}
    for i, row in ipairs(READ[name]) do
        if at + row[2] > buffer:len() then
            tree:add(F.bad, buffer(), name .. " is cut off")
            return nil
        end
        local range = buffer(at, row[2])
        tree:add_le(row[1], range)
        values[i] = row[2] <= 4 and range:le_uint() or 0
        at = at + row[2]
    end
    return at, values
end

local function rest(field, buffer, tree, at)
    if at < buffer:len() then
        tree:add(field, buffer(at))
    end
end

local argument_readers = {}

function argument_readers.number(row, buffer, at)
    if at + 8 > buffer:len() then return nil end
    local value = buffer(at, 8):le_float()
    local told = value ~= value and "left out" or string.format("%.10g", value)
    if value == value and row[3] ~= "" then told = told .. " " .. row[3] end
    return at + 8, told
end

function argument_readers.choice(row, buffer, at)
    if at + 8 > buffer:len() then return nil end
    local value = buffer(at, 8):le_float()
    return at + 8, value ~= value and "left out" or row[4][value + 1] or "no such choice"
end

function argument_readers.text(row, buffer, at)
    if at >= buffer:len() then return nil end
    local length = buffer(at, 1):uint()
    if at + 1 + length > buffer:len() then return nil end
    if length == 0 then return at + 1, "left out" end
    return at + 1 + length, buffer(at + 1, length):string(ENC_UTF_8)
end

function argument_readers.points(row, buffer, at)
    if at >= buffer:len() then return nil end
    local count, told = buffer(at, 1):uint(), {}
    if at + 1 + 8 * count > buffer:len() then return nil end
    for i = 0, 2 * count - 1 do
        table.insert(told, string.format("%.3f", buffer(at + 1 + 4 * i, 4):le_int() / 1000))
    end
    return at + 1 + 8 * count, table.concat(told, " ") .. " " .. row[3]
end

local payloads = {}

function payloads.MAVLINK(buffer, tree, pinfo)
    mavlink_proto.dissector(buffer, pinfo, tree)
end

function payloads.TELECOMMAND(buffer, tree, pinfo)
    local at, values = struct("telecommand", buffer, tree, 0)
    if not at then return end
    local id = values[5]
    pinfo.cols.info = string.format("%s #%d", COMMANDS[id] or "unknown command", values[1])
    for _, row in ipairs(ARGUMENTS[id] or {}) do
        local stop, told = argument_readers[row[2]](row, buffer, at)
        if not stop then
            tree:add(F.bad, buffer(), row[1] .. " is cut off")
            return
        end
        tree:add(F.argument, buffer(at, stop - at), row[1] .. " = " .. told)
        at = stop
    end
end

function payloads.REPORT(buffer, tree, pinfo, down)
    if not down then
        pinfo.cols.info = "acknowledgement of events"
        local at = struct("acknowledgement", buffer, tree, 0)
        if at then rest(F.bits, buffer, tree, at) end
        return
    end
    local at, values = struct("report", buffer, tree, 0)
    if not at then return end
    pinfo.cols.info = string.format("#%d of station %d %s", values[1], values[2], STATES[values[4]] or "?")
    for _ = 1, values[6] do
        if at + 8 > buffer:len() then
            tree:add(F.bad, buffer(), "values are cut off")
            return
        end
        tree:add_le(F.value, buffer(at, 8))
        at = at + 8
    end
    if at < buffer:len() then
        tree:add_packet_field(F.text, buffer(at), ENC_UTF_8)
    end
end

function payloads.BULK_CHUNK(buffer, tree, pinfo)
    local at, values = struct("chunk", buffer, tree, 0)
    if not at then return end
    if values[3] ~= ANNOUNCEMENT then
        pinfo.cols.info = string.format("object %d, chunk %d", values[1], values[3])
        rest(F.data, buffer, tree, at)
        return
    end
    pinfo.cols.info = string.format("object %d, announcement", values[1])
    at, values = struct("announcement", buffer, tree, at)
    if not at then return end
    if at + values[4] + values[5] > buffer:len() then
        tree:add(F.bad, buffer(), "names are cut off")
        return
    end
    tree:add_packet_field(F.name, buffer(at, values[4]), ENC_UTF_8)
    tree:add_packet_field(F.codec, buffer(at + values[4], values[5]), ENC_UTF_8)
end

function payloads.BULK_BITMAP(buffer, tree, pinfo)
    local at, values = struct("bitmap", buffer, tree, 0)
    if not at then return end
    pinfo.cols.info = string.format("object %d, has all below %d", values[1], values[4])
    rest(F.bits, buffer, tree, at)
end

function link_proto.dissector(buffer, pinfo, tree)
    pinfo.cols.protocol = "El Dorado"
    local top = tree:add(link_proto, buffer(), "El Dorado link (" .. buffer:len() .. " B)")
    local at, values = struct("header", buffer, top, 0)
    if not at then return end
    local size = buffer:len() - at - TAG_BYTES
    if size <= 0 then
        top:add(F.bad, buffer(), size < 0 and "the tag is cut off" or "no payload")
        return
    end
    local name = KINDS[values[1]]
    local station = "station " .. values[2]
    local down = values[2] == DOWNLINK_KEY_ID
    pinfo.cols.src = down and "rover" or station
    pinfo.cols.dst = down and "ground" or "rover"
    local part = top:add(F.payload, buffer(at, size))
    if payloads[name] then
        payloads[name](buffer(at, size):tvb(), part, pinfo, down)
    end
    if pinfo.cols.info ~= nil and name ~= "MAVLINK" then
        pinfo.cols.info:prepend((name or "unknown kind") .. ": ")
    end
    top:add(F.tag, buffer(at + size, TAG_BYTES))
end

-- A capture of the link's datagrams has link type USER0; the gateway speaks MAVLink on UDP.
DissectorTable.get("wtap_encap"):add(wtap.USER0, link_proto)
local ports = DissectorTable.get("udp.port")
ports:add_for_decode_as(link_proto)
ports:add(14550, mavlink_proto)
ports:add(14551, mavlink_proto)
