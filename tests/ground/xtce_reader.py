"""Reads nothing but an XTCE file: telemetry by space_packet_parser, telecommands made by a few lines of our own.

The library knows no telecommands. What is here knows of XTCE 1.2 what our file uses, and nothing of our tables.
"""

import struct
import xml.etree.ElementTree as Xml

XTCE = {"x": "http://www.omg.org/spec/XTCE/20180204"}


class CommandWriter:
    """Packets of the commands that an XTCE file describes."""

    def __init__(self, text: str) -> None:
        root = Xml.fromstring(text.encode())
        types = root.find("x:CommandMetaData/x:ArgumentTypeSet", XTCE)
        self._types = {kind.get("name"): kind for kind in types}
        commands = root.findall("x:CommandMetaData/x:MetaCommandSet/x:MetaCommand", XTCE)
        self.commands = {command.get("name"): command for command in commands}

    def packet(self, command: str, **given) -> bytes:
        """The packet of a command with these arguments; what is left out takes its initial value."""
        meta = self.commands[command]
        arguments = {a.get("name"): a for a in meta.findall("x:ArgumentList/x:Argument", XTCE)}
        assert set(given) <= set(arguments)
        made = b""
        for entry in meta.find("x:CommandContainer/x:EntryList", XTCE):
            if entry.tag.endswith("FixedValueEntry"):
                data = bytes.fromhex(entry.get("binaryValue"))
                assert 8 * len(data) == int(entry.get("sizeInBits"))
                made += data
            else:
                argument = arguments[entry.get("argumentRef")]
                value = given.get(argument.get("name"), argument.get("initialValue"))
                assert value is not None, f"{command} needs {argument.get('name')}"
                made += self._encoded(self._types[argument.get("argumentTypeRef")], value)
        return made

    def _encoded(self, kind, value) -> bytes:
        name = kind.tag.rpartition("}")[2]
        if name == "StringArgumentType":
            size = int(kind.find("x:StringDataEncoding/x:SizeInBits/x:Fixed/x:FixedValue", XTCE).text) // 8
            raw = str(value).encode()
            assert len(raw) < size
            return raw.ljust(size, b"\0")
        if name == "FloatArgumentType":
            valid = kind.find("x:ValidRangeSet/x:ValidRange", XTCE)
            if valid is not None:
                assert float(valid.get("minInclusive")) <= float(value) <= float(valid.get("maxInclusive"))
            return struct.pack(">d", float(value))
        size = int(kind.find("x:IntegerDataEncoding", XTCE).get("sizeInBits")) // 8
        labels = {e.get("label"): int(e.get("value")) for e in kind.findall("x:EnumerationList/x:Enumeration", XTCE)}
        return (labels[value] if labels else int(value)).to_bytes(size, "big")
