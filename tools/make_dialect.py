"""protocol/eldorado_dialect.py from protocol/eldorado.xml, by pymavlink's generator; no network.

python -m tools.make_dialect [OUTPUT]. Of the common set, copied from the installed pymavlink, only the messages that
the rover sends are kept, with their enums: all 219 cost each process 6 MB, and 70 MB where they are compiled anew.
"""

import argparse
import contextlib
import io
import shutil
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

from pymavlink import dialects
from pymavlink.generator import mavgen, mavparse

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "protocol" / "eldorado.xml"
TARGET = ROOT / "protocol" / "eldorado_dialect.py"
FILES = ("common.xml", "standard.xml", "minimal.xml")
KEPT = {"HEARTBEAT", "SYS_STATUS", "ATTITUDE", "LOCAL_POSITION_NED", "STATUSTEXT"}


def generate() -> str:
    """The text of the Python dialect. Raises RuntimeError where the generator refuses the XML."""
    common = Path(dialects.__path__[0]) / "v20"
    used = {f.get("enum", "") for name in FILES for f in _kept_fields(ET.parse(common / name))}
    used |= {f.get("enum", "") for f in ET.parse(SOURCE).iter("field")}
    with tempfile.TemporaryDirectory() as folder:
        for name in FILES:
            _prune(common / name, Path(folder) / name, used)
        shutil.copy(SOURCE, folder)
        options = argparse.Namespace(
            output=str(Path(folder) / "eldorado_dialect.py"),
            language="Python3",
            wire_protocol=mavparse.PROTOCOL_2_0,
            validate=True,
            strict_units=False,
        )
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            done = mavgen.mavgen(options, [str(Path(folder) / SOURCE.name)])
        if not done:
            raise RuntimeError(f"{SOURCE.name}: {said.getvalue()}")
        return Path(options.output).read_text()


def _kept_fields(tree: ET.ElementTree) -> list[ET.Element]:
    return [field for message in tree.iter("message") if message.get("name") in KEPT for field in message.iter("field")]


def _prune(source: Path, target: Path, enums: set[str]) -> None:
    """A copy of a message set with the kept messages and the enums of `enums` alone."""
    tree = ET.parse(source)
    for group, kept in (("messages", KEPT), ("enums", enums)):
        for parent in tree.iter(group):
            for child in list(parent):
                if child.get("name") not in kept:
                    parent.remove(child)
    tree.write(target)


if __name__ == "__main__":
    (Path(sys.argv[1]) if len(sys.argv) > 1 else TARGET).write_text(generate())
