"""Generator of the XTCE 1.2 file (CCSDS 660.1-G, OMG) of the packets of `packet_table`, for YAMCS and similar systems.

    SpaceSystem -> TelemetryMetaData: types, parameters, a container `space_packet` with the headers and one for each
                                      row, which inherits it where its APID says so
                -> CommandMetaData:   types of arguments, and for each command its whole packet, header included

A pure function of the tables; `make docs` writes it to docs/eldorado.xtce.xml.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as Xml

from protocol.ccsds import packet_table, space_packets
from protocol.ccsds.packet_table import Field, TelemetryPacket
from protocol.tables.commands import TABLE as COMMANDS
from protocol.tables.commands import Command

SPACE_SYSTEM = "ElDorado"
_NAMESPACE = "http://www.omg.org/spec/XTCE/20180204"
_SCHEMA = "https://www.omg.org/spec/XTCE/20180204/SpaceSystem.xsd"
_INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
_HEADER = (  # name, bits, meaning
    ("ccsds_version", 3, "0"), ("ccsds_type", 1, "0: telemetry"), ("ccsds_secondary_header", 1, "1: there is one"),
    ("ccsds_apid", 11, "which packet"), ("ccsds_sequence_flags", 2, "3: a whole packet"),
    ("ccsds_sequence_count", 14, "of the APID"), ("ccsds_length", 16, "bytes that follow, minus 1"),
    ("time_p_field", 8, "0x2F: CUC, epoch of the agency, 4 + 3 octets"),
    ("time_seconds", 32, "onboard time: seconds since the flight program's start"),
    ("time_fraction", 24, "and so many 2**-24 s"), ("boot_id", 32, "which start of the flight program"),
)  # fmt: skip
_PACKET = "space_packet"


def xtce() -> str:
    """Return the text of the file."""
    Xml.register_namespace("xsi", _INSTANCE)
    root = Xml.Element(
        "SpaceSystem",
        {"name": SPACE_SYSTEM, "xmlns": _NAMESPACE, f"{{{_INSTANCE}}}schemaLocation": f"{_NAMESPACE} {_SCHEMA}"},
    )
    _described(root, "Made from protocol/tables/telemetry.py and protocol/tables/commands.py by tools/make_docs.py")
    telemetry = Xml.SubElement(root, "TelemetryMetaData")
    _parameters(telemetry)
    _containers(Xml.SubElement(telemetry, "ContainerSet"))
    commands = Xml.SubElement(root, "CommandMetaData")
    _argument_types(Xml.SubElement(commands, "ArgumentTypeSet"))
    wanted = Xml.SubElement(commands, "MetaCommandSet")
    for row in COMMANDS:
        _command(wanted, row)
    Xml.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + Xml.tostring(root, encoding="unicode") + "\n"


def _described(element: Xml.Element, text: str) -> None:
    element.set("shortDescription", text)


# -- telemetry -------------------------------------------------------------------------------------------------


def _parameters(telemetry: Xml.Element) -> None:
    types, parameters = (Xml.SubElement(telemetry, name) for name in ("ParameterTypeSet", "ParameterSet"))
    for bits in dict.fromkeys(bits for _, bits, _ in _HEADER):
        kind = Xml.SubElement(types, "IntegerParameterType", name=f"header_{bits}_bits", signed="false")
        _integer(kind, bits)
    for name, bits, meaning in _HEADER:
        _described(Xml.SubElement(parameters, "Parameter", name=name, parameterTypeRef=f"header_{bits}_bits"), meaning)
    for row in packet_table.TABLE:
        for field in row.fields:
            _type(types, field, "Parameter", f"{field.name}_type")
            named = Xml.SubElement(parameters, "Parameter", name=field.name, parameterTypeRef=f"{field.name}_type")
            _described(named, field.meaning)


def _containers(containers: Xml.Element) -> None:
    head = Xml.SubElement(containers, "SequenceContainer", name=_PACKET, abstract="true")
    entries = Xml.SubElement(head, "EntryList")
    for name, _, _ in _HEADER:
        Xml.SubElement(entries, "ParameterRefEntry", parameterRef=name)
    for row in packet_table.TABLE:
        _container(containers, row)


def _container(containers: Xml.Element, row: TelemetryPacket) -> None:
    made = Xml.SubElement(containers, "SequenceContainer", name=row.name)
    _described(made, row.meaning)
    entries = Xml.SubElement(made, "EntryList")
    for field in row.fields:
        Xml.SubElement(entries, "ParameterRefEntry", parameterRef=field.name)
    base = Xml.SubElement(made, "BaseContainer", containerRef=_PACKET)
    criteria = Xml.SubElement(base, "RestrictionCriteria")
    Xml.SubElement(criteria, "Comparison", parameterRef="ccsds_apid", value=str(row.apid), useCalibratedValue="false")


# -- types -----------------------------------------------------------------------------------------------------


def _type(types: Xml.Element, field: Field, of: str, name: str) -> None:
    """Add a ParameterType or ArgumentType with its unit, encoding and limits."""
    if field.names is not None:
        made = Xml.SubElement(types, f"Enumerated{of}Type", name=name)
        _integer(made, field.bits)
        listed = Xml.SubElement(made, "EnumerationList")
        for number, label in field.names.items():
            Xml.SubElement(listed, "Enumeration", value=str(number), label=label)
    elif field.form == "text":
        _text(Xml.SubElement(types, f"String{of}Type", name=name), field.bits)
    elif field.form == "f64":
        made = Xml.SubElement(types, f"Float{of}Type", name=name, sizeInBits="64")
        _unit(made, field.unit)
        Xml.SubElement(made, "FloatDataEncoding", encoding="IEEE754_1985", sizeInBits="64")
        _limits(made, field, of)
    else:
        made = Xml.SubElement(types, f"Integer{of}Type", name=name, signed="false", sizeInBits=str(field.bits))
        _unit(made, field.unit)
        _integer(made, field.bits)
        _limits(made, field, of)


def _unit(made: Xml.Element, unit: str) -> None:
    units = Xml.SubElement(made, "UnitSet")
    if unit:
        Xml.SubElement(units, "Unit").text = unit


def _integer(made: Xml.Element, bits: int) -> None:
    Xml.SubElement(made, "IntegerDataEncoding", encoding="unsigned", sizeInBits=str(bits))


def _text(made: Xml.Element, bits: int) -> None:
    size = Xml.SubElement(Xml.SubElement(made, "StringDataEncoding", encoding="UTF-8"), "SizeInBits")
    Xml.SubElement(Xml.SubElement(size, "Fixed"), "FixedValue").text = str(bits)
    Xml.SubElement(size, "TerminationChar").text = "00"


def _limits(made: Xml.Element, field: Field, of: str) -> None:
    """Add a parameter's alarm limits, or the valid range of an argument. An optional argument may be NaN: no range."""
    if field.limits is None:
        return
    named = {
        word: repr(float(limit))
        for word, limit in zip(("minInclusive", "maxInclusive"), field.limits)
        if math.isfinite(limit)
    }
    if of == "Parameter":
        alarm = Xml.SubElement(Xml.SubElement(made, "DefaultAlarm"), "StaticAlarmRanges")
        Xml.SubElement(alarm, "WarningRange", named)
    elif field.required:
        Xml.SubElement(Xml.SubElement(made, "ValidRangeSet"), "ValidRange", named)


# -- telecommands ----------------------------------------------------------------------------------------------


def _argument_types(types: Xml.Element) -> None:
    _type(types, packet_table.COMMAND_HEAD[1], "Argument", "start_s_type")
    for row in COMMANDS:
        for argument in row.arguments:
            _type(types, packet_table.field_of(argument), "Argument", f"{row.name}_{argument.name}_type")


def _command(commands: Xml.Element, row: Command) -> None:
    made = Xml.SubElement(commands, "MetaCommand", name=row.name)
    _described(made, row.meaning)
    arguments = Xml.SubElement(made, "ArgumentList")
    start = Xml.SubElement(arguments, "Argument", name="start_s", argumentTypeRef="start_s_type", initialValue="0.0")
    _described(start, packet_table.COMMAND_HEAD[1].meaning)
    for argument in row.arguments:
        named = Xml.SubElement(
            arguments, "Argument", name=argument.name, argumentTypeRef=f"{row.name}_{argument.name}_type"
        )
        _described(named, packet_table.field_of(argument).meaning)
        if not argument.required:
            named.set("initialValue", packet_table.left_out(argument))
    entries = Xml.SubElement(Xml.SubElement(made, "CommandContainer", name=f"{row.name}_packet"), "EntryList")
    size = sum(field.bits for field in packet_table.fields_of(row)) // 8
    head = space_packets.encode(
        space_packets.Packet(space_packets.TELECOMMAND, packet_table.COMMAND_APID, 0, bytes(size))
    )[: space_packets.HEAD.size]
    _fixed(entries, "primary_header", head)
    _fixed(entries, "command", bytes([row.id]))
    for name in ("start_s", *(argument.name for argument in row.arguments)):
        Xml.SubElement(entries, "ArgumentRefEntry", argumentRef=name)


def _fixed(entries: Xml.Element, name: str, data: bytes) -> None:
    Xml.SubElement(entries, "FixedValueEntry", name=name, binaryValue=data.hex(), sizeInBits=str(8 * len(data)))
