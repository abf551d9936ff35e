"""The numbers of a station: on the disk, name and all, before one of them is used."""

import os
from pathlib import Path

from ground.station.memory import Memory


def test_numbers_are_forced_to_the_disk_and_then_the_name_of_their_file_to_the_folder(tmp_path, monkeypatch):
    done = []
    fsync, replace = os.fsync, os.replace

    def forced(descriptor):
        done.append(Path(os.readlink(f"/proc/self/fd/{descriptor}")).name)
        fsync(descriptor)

    def renamed(source, target):
        done.append(f"rename to {Path(target).name}")
        replace(source, target)

    monkeypatch.setattr(os, "fsync", forced)
    monkeypatch.setattr(os, "replace", renamed)
    folder = tmp_path / "numbers"
    Memory(str(folder), 3).reserve()
    assert done == ["station-3.new", "rename to station-3.json", "numbers"]
