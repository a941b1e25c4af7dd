"""ROS bags: ROS 2 (a folder with metadata.yaml, or a .db3 in one) and ROS 1 (.bag)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hdopt.recordings.formats.messages import Collector, stamp_ns
from hdopt.recordings.table import Table


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """Every number of every message as '/topic.field'; a joint state's arrays as '/joint_states.position[joint]'.

    Only the topics that `wanted` names are read where it is given.

    `path` of the file; `wanted` names the columns that will be used, None for all.
    """
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    folder = path.parent if path.suffix.lower() in (".db3", ".mcap") else path
    collector = Collector()
    with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        chosen = [
            connection
            for connection in reader.connections
            if not wanted or any(name.startswith(f"{connection.topic}.") for name in wanted)
        ] or reader.connections
        for connection, logged, raw in reader.messages(connections=chosen):
            message = reader.deserialize(raw, connection.msgtype)
            collector.add(connection.topic, stamp_ns(message) or logged, message)
    return collector.table()
