"""protocol/eldorado_dialect.py from protocol/eldorado.xml, by pymavlink's generator; no network.

python -m tools.make_dialect [OUTPUT]. The common set is copied from the installed pymavlink.
"""

import argparse
import contextlib
import io
import shutil
import sys
import tempfile
from pathlib import Path

from pymavlink import dialects
from pymavlink.generator import mavgen, mavparse

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "protocol" / "eldorado.xml"
TARGET = ROOT / "protocol" / "eldorado_dialect.py"


def generate() -> str:
    """The text of the Python dialect. Raises RuntimeError where the generator refuses the XML."""
    common = Path(dialects.__path__[0]) / "v20"
    with tempfile.TemporaryDirectory() as folder:
        for name in ("common.xml", "standard.xml", "minimal.xml"):
            shutil.copy(common / name, folder)
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


if __name__ == "__main__":
    (Path(sys.argv[1]) if len(sys.argv) > 1 else TARGET).write_text(generate())
