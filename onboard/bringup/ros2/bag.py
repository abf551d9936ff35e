"""ROS 2 bag of a record: a folder with metadata.yaml and one MCAP file, as `ros2 bag` and rosbags read it."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from onboard.bringup.ros2.follow import TOPICS, messages
from onboard.bringup.ros2.types import store
from onboard.record.reader import Record
from onboard.record.replay import config_of

METADATA = "metadata.yaml"
_VERSION: Literal[8] = 8  # of the metadata: read by Humble's and all later releases
_FOREVER = QosTime(2_147_483_647, 4_294_967_295)
_LATCHED = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    _FOREVER,
    _FOREVER,
    QosLiveliness.AUTOMATIC,
    _FOREVER,
    False,
)


def write_bag(record: Record, channels: Sequence[str], out: Path) -> int:
    """Write the bag into the folder `out`, in place of a bag that is there. Returns the number of messages.

    An interrupted or failed export leaves what was there. Raises DamagedRecordError, OSError.
    """
    part = out.with_name(f".{out.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir()
    try:
        count = _write(record, channels, part / out.name)
        if out.exists():
            shutil.rmtree(out)
        (part / out.name).replace(out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return count


def is_bag(folder: Path) -> bool:
    """True for a folder that holds one bag and nothing else."""
    files = list(folder.iterdir()) if folder.is_dir() else []
    return folder / METADATA in files and all(file.name == METADATA or file.suffix == ".mcap" for file in files)


def _write(record: Record, channels: Sequence[str], folder: Path) -> int:
    types, count = store(), 0
    writer = Writer(folder, version=_VERSION, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        connections = {
            topic: writer.add_connection(
                topic, row.kind, typestore=types, offered_qos_profiles=[_LATCHED] if row.latched else []
            )
            for topic, row in TOPICS.items() if row.source in channels
        }  # fmt: skip
        for at_ns, topic, message in messages(record, config_of(record), channels):
            connection = connections[topic]
            writer.write(connection, at_ns, types.serialize_cdr(message, connection.msgtype))
            count += 1
    return count
