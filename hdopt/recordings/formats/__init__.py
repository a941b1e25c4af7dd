"""Reading files of test benches: one reader a format, chosen by the file's name, its library imported only then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Protocol

from hdopt.errors import HdoptError, MissingLibrary
from hdopt.files import note_input
from hdopt.recordings.table import Table


class Reader(Protocol):
    """Reads one file. `wanted` names the columns or paths that will be used, None where nobody knows yet: a reader may
    leave the rest of a large file alone."""

    def __call__(self, path: Path, wanted: Sequence[str] | None) -> Table: ...


READERS = {
    ".csv": "text",
    ".txt": "text",
    ".tsv": "text",
    ".dat": "text",
    ".asc": "text",
    ".parquet": "parquet",
    ".mat": "matlab",
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".hdf": "hdf5",
    ".tdms": "tdms",
    ".mcap": "mcap_file",
    ".bag": "rosbag",
    ".db3": "rosbag",
    ".mf4": "mdf",
    ".mdf": "mdf",
    ".log": "text",
}
"""A file name's ending -> the module of this package that reads it. A PHD2 guide log is told by its first line."""

EXTRAS = {"h5py": "formats", "nptdms": "formats", "rosbags": "formats", "mcap": "formats", "asammdf": "mdf"}
"""Library -> the extra that installs it."""


def ending(path: Path) -> str:
    """The ending that says what a file is: that before '.gz' where it is compressed.

    `path` need not exist.
    """
    suffixes = [suffix.lower() for suffix in path.suffixes]
    return suffixes[-2] if suffixes[-1:] == [".gz"] and len(suffixes) > 1 else (suffixes[-1] if suffixes else "")


def read_table(path: Path, wanted: Sequence[str] | None = None) -> Table:
    """The channels of a file, or of a ROS 2 bag's folder.

    Raises `HdoptError` where there is no such file, nothing reads its format, or it holds no rows, and
    `MissingLibrary` where the library of its format is not installed.

    `path` of the file or folder; `wanted` names the columns that will be used, None for all.
    """
    kind = ending(path)
    if not path.exists():
        raise HdoptError(f"no file {path}; give the path of a recording")
    note_input(path)
    is_bag = path.is_dir() and (path / "metadata.yaml").is_file()
    if path.is_dir() and not is_bag:
        raise HdoptError(f"{path} is a folder without metadata.yaml; give a file, or the folder of a ROS 2 bag")
    module = "rosbag" if is_bag else READERS.get(kind)
    if module is None:
        raise HdoptError(f"{path.name}: recordings are read from {', '.join(READERS)} (.gz too), not from {kind!r}")
    if path.is_file():
        note_input(path)
    reader: Reader = import_module(f"hdopt.recordings.formats.{module}").read
    try:
        table = reader(path, wanted)
        if wanted and not set(wanted) <= set(table.channels):  # a name that is not there: the message lists what is
            whole = reader(path, None)
            table = replace(whole, channels={**whole.channels, **table.channels})
    except HdoptError:
        raise
    except ModuleNotFoundError as error:
        library = (error.name or "").split(".")[0]
        if library not in EXTRAS:
            raise
        raise MissingLibrary(
            f"{path.name} needs the library {library}, which is not installed; pip install 'hdopt[{EXTRAS[library]}]'"
        ) from error
    except Exception as error:
        # The libraries of eight formats raise each their own errors, down to struct.error and KeyError.
        said = (str(error).splitlines() or [""])[0][:200] or type(error).__name__
        raise HdoptError(f"{path.name} cannot be read as {kind or 'a bag'}: {said}") from error
    if table.rows == 0:
        raise HdoptError(f"{path.name} holds no rows; give a recording with samples in it")
    return table
