"""MCAP files: ROS 2 messages by rosbags, JSON messages by the mcap library itself."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from hdopt.errors import HdoptError
from hdopt.recordings.formats.messages import Collector, stamp_ns
from hdopt.recordings.table import Table


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """Every number of every message as '/topic.field'. Messages are ROS 2 (CDR) or JSON; others are left out.

    `path` of the file; `wanted` names the columns that will be used, None for all.
    """
    from mcap.reader import make_reader

    collector = Collector()
    left_out: set[str] = set()
    stores: dict[str, object] = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if wanted and not any(name.startswith(f"{channel.topic}.") for name in wanted):
                continue
            if channel.message_encoding == "json":
                collector.add(channel.topic, message.log_time, json.loads(message.data))
            elif channel.message_encoding == "cdr" and schema is not None:
                decoded = _ros_message(stores, schema.name, schema.data.decode(), message.data)
                collector.add(channel.topic, stamp_ns(decoded) or message.log_time, decoded)
            else:
                left_out.add(f"{channel.topic} ({channel.message_encoding})")
    table = collector.table()
    if table.rows == 0 and left_out:
        raise HdoptError(
            f"{path.name} holds no messages in JSON or CDR, only {', '.join(sorted(left_out)[:6])}; export it as "
            "one of them, or as .csv"
        )
    notes = (f"left out, neither JSON nor CDR: {', '.join(sorted(left_out))}",) if left_out else ()
    return Table(table.channels, (*table.notes, *notes))


def _ros_message(stores: dict[str, object], name: str, definition: str, raw: bytes) -> object:
    """One CDR message, by the definition that the file brings with it."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    full = name if name.count("/") == 2 else name.replace("/", "/msg/")
    if full not in stores:
        store = get_typestore(Stores.ROS2_HUMBLE)
        if full not in store.types:
            store.register(get_types_from_msg(definition, full))
        stores[full] = store
    return stores[full].deserialize_cdr(raw, full)  # type: ignore[attr-defined]  # the store's class is private
