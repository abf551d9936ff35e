"""docs/icd.md can be built from: its C code is the checksum, its example a frame, its picture has every bit once."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from onboard.bringup.can.load import Case, analyse
from protocol.generated.can_codec import TABLE
from protocol.generated.can_frames import FRAMES

PAGE = (Path(__file__).parents[3] / "docs" / "icd.md").read_text()
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("g++")


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
def test_the_c_code_of_the_page_computes_the_checksum_of_every_frame(tmp_path):
    (code,) = re.findall(r"```c\n(.*?)```", PAGE, re.DOTALL)
    calls = []
    for can_id, row in TABLE.items():
        values = [signal.high for signal in FRAMES[can_id].signals if signal.name in row.fields]
        data = row.encode(*values, 11)
        bytes_of = ", ".join(map(str, data))
        calls.append(f"{{ uint8_t d[8] = {{ {bytes_of} }}; if (frame_crc({can_id}, d) != d[7]) return 1; }}")
    main = "\n".join(["#include <stdint.h>", code, "int main(void) {", *calls, "return 0; }"])
    (tmp_path / "crc.c").write_text(main)
    subprocess.run([COMPILER, "-Wall", "-Werror", "-o", tmp_path / "crc", tmp_path / "crc.c"], check=True)
    assert subprocess.run([tmp_path / "crc"], check=False).returncode == 0


def test_the_example_of_the_page_is_a_frame():
    (text,) = re.findall(r"`101#(\w{16})`", PAGE)
    assert TABLE[0x101].decode(bytes.fromhex(text)) == (2, 0.25, -1.5)


def test_every_frame_and_every_signal_has_its_row():
    for can_id, layout in FRAMES.items():
        assert f"| 0x{can_id:03X} | `{layout.name}` | {layout.sender} |" in PAGE
        for signal in layout.signals[:-2]:
            assert f"| `{signal.name}` | {signal.start}" in PAGE
    worst = analyse(Case.EVERYTHING)[-1]
    assert re.search(rf"\| `{worst.name}` \| .* \| {worst.response_s * 1e3:.2f} \|", PAGE)
