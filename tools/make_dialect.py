"""Generator of protocol/generated/eldorado_dialect.py from protocol/eldorado.xml, by pymavlink's generator; no network.

python -m tools.make_dialect [OUTPUT]. Of the common set, copied from the installed pymavlink, only the messages that
the rover sends are included, with their enums: all 219 cost each process 6 MB, and 70 MB while they are compiled.
"""

import argparse
import contextlib
import io
import shutil
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Collection
from pathlib import Path

from pymavlink import dialects
from pymavlink.generator import mavgen, mavparse

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "protocol" / "eldorado.xml"
TARGET = ROOT / "protocol" / "generated" / "eldorado_dialect.py"
FILES = ("common.xml", "standard.xml", "minimal.xml")
KEPT = {"HEARTBEAT", "SYS_STATUS", "ATTITUDE", "LOCAL_POSITION_NED", "STATUSTEXT"}


def generate() -> str:
    """Return the text of the Python dialect. Raises RuntimeError if the generator rejects the XML."""
    return made("Python3", KEPT)


def made(language: str, kept: Collection[str], commands: Collection[str] = ()) -> str:
    """Run the generator on the XML and the included messages of the common set; return its output in a language.

    kept: messages of the common set that are included.
    commands: entries of MAV_CMD that are included; the others are removed, with their parameters.
    """
    common = Path(dialects.__path__[0]) / "v20"
    used = {f.get("enum", "") for name in FILES for f in _kept_fields(ET.parse(common / name), kept)}
    used |= {f.get("enum", "") for f in ET.parse(SOURCE).iter("field")}
    used |= {
        p.get("enum", "")
        for name in FILES
        for entry in ET.parse(common / name).iter("entry")
        if entry.get("name") in commands
        for p in entry.iter("param")
    }
    with tempfile.TemporaryDirectory() as folder:
        for name in FILES:
            _prune(common / name, Path(folder) / name, {"messages": kept, "enums": used}, commands)
        shutil.copy(SOURCE, folder)
        options = argparse.Namespace(
            output=str(Path(folder) / "eldorado_dialect.out"),
            language=language,
            wire_protocol=mavparse.PROTOCOL_2_0,
            validate=True,
            strict_units=False,
        )
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            done = mavgen.mavgen(options, [str(Path(folder) / SOURCE.name)])
        if not done:
            raise RuntimeError(f"{SOURCE.name}: {said.getvalue()}")
        return next(Path(folder).glob("eldorado_dialect*")).read_text()


def _kept_fields(tree: ET.ElementTree, kept: Collection[str]) -> list[ET.Element]:
    return [field for message in tree.iter("message") if message.get("name") in kept for field in message.iter("field")]


def _prune(source: Path, target: Path, wanted: dict[str, Collection[str]], commands: Collection[str]) -> None:
    """Write a copy of a message set with only the wanted messages and enums."""
    tree = ET.parse(source)
    for group, kept in wanted.items():
        for parent in tree.iter(group):
            for child in list(parent):
                if child.get("name") not in kept:
                    parent.remove(child)
    for enum in tree.iter("enum"):
        if enum.get("name") == "MAV_CMD":
            for entry in enum.findall("entry"):
                if entry.get("name") not in commands:
                    enum.remove(entry)
    tree.write(target)


if __name__ == "__main__":
    (Path(sys.argv[1]) if len(sys.argv) > 1 else TARGET).write_text(generate())
