"""MCAP files: which messages are taken, and what is said of those that are not."""

import json

import pytest

from hdopt.errors import HdoptError
from hdopt.recordings.formats import mcap_file

writers = pytest.importorskip("mcap.writer", reason="mcap is an extra of its own")


def written(path, *channels):
    """A file of two messages in each channel of a topic and an encoding, with the numbers 1 and 2 as `x`."""
    with path.open("wb") as stream:
        writer = writers.Writer(stream)
        writer.start()
        schema = writer.register_schema("numbers", "jsonschema", b"{}")
        for topic, encoding in channels:
            channel = writer.register_channel(topic, encoding, schema)
            for number in (1, 2):
                writer.add_message(channel, number * 10**9, json.dumps({"x": number}).encode(), number * 10**9)
        writer.finish()
    return path


def names(table):
    return set(table.channels)


def test_only_topics_whose_columns_are_wanted_are_read(tmp_path):
    """Fault caught: the other topics read in their place."""
    path = written(tmp_path / "two.mcap", ("/rig", "json"), ("/other", "json"))
    assert {"/rig.x", "/other.x"} <= names(mcap_file.read(path, None))
    wanted = names(mcap_file.read(path, ["/rig.x"]))
    assert "/rig.x" in wanted and "/other.x" not in wanted


def test_messages_in_another_encoding_are_left_out_and_told(tmp_path):
    """Faults caught: JSON taken for something else, and what is left out not said."""
    both = mcap_file.read(written(tmp_path / "both.mcap", ("/rig", "json"), ("/raw", "protobuf")), None)
    assert "/rig.x" in names(both) and "/raw.x" not in names(both)
    assert both.notes[-1] == "left out, neither JSON nor CDR: /raw (protobuf)"
    with pytest.raises(HdoptError, match=r"holds no messages in JSON or CDR, only /raw \(protobuf\)"):
        mcap_file.read(written(tmp_path / "raw.mcap", ("/raw", "protobuf")), None)
