"""How bytes come in and go out: text and JSON read with a message for every fault, outputs written whole or not at all.

An output gets a passing name in its own folder, reaches the disk, and only then takes its name: whoever looks sees the
old file or the new one. A symbolic link is followed (the link stays, its target changes); a device, pipe or socket is
written to as it is, and a pipe that nothing reads is refused.
"""

from __future__ import annotations

import codecs
import csv
import errno
import json
import math
import os
import re
import secrets
import signal
import stat
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol  # Any: values of JSON

from hdopt.errors import HdoptError
from hdopt.interruption import interruption

if TYPE_CHECKING:
    import pandas as pd

LARGEST_TEXT = 16 * 2**20
"""Bytes of the largest study file or JSON input; real ones have a few thousand."""
STREAMS = ("/dev/fd/", "/dev/stdout", "/dev/stderr", "/proc/self/fd/")
"""Names of open streams: where one leads to a plain file, that file is still written through the stream."""
JsonReady = dict[str, Any]
"""What `to_json` writes: numbers, text, arrays, and lists and mappings of them to any depth, which no narrower type
says in a way that readers of a key could use."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of a disk, a quota or a process that may write no more."""
PASSING = ".hdopt-passing"
"""End of the names that files bear until they are whole."""


def to_json(result: Mapping[str, Any]) -> str:
    """JSON text of `result`; numpy numbers and arrays become plain ones, numbers that are not finite become null."""
    return json.dumps(_plain(result), indent=2, allow_nan=False)


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


@dataclass
class FilesOfWork:
    """Which files one piece of work reads and which it is going to write: none may be both."""

    inputs: dict[Path, str] = field(default_factory=dict)
    """Real path -> SHA-256 of what was read."""
    outputs: dict[Path, Path] = field(default_factory=dict)
    """Real path -> the name it was given by."""
    written: list[Path] = field(default_factory=list)
    """Those of `outputs` that are written, by the names they were given by."""
    began: float = field(default_factory=time.time)
    facts: dict[str, str] = field(default_factory=dict)
    """What else is to be known of the work: its study and that one's hash."""
    place: Callable[[], str] | None = None
    """Says where to look when numbers lead to no result; None for work without a study."""

    values: Callable[[str], tuple[str, ...]] | None = None
    """Says where the values and keys stand that a message shows or names; None for work without a study."""

    def place_of_numbers(self) -> str:
        """Where the numbers of this work stand: in its study, else in its inputs."""
        if self.place is not None:
            return self.place()
        return ", ".join(path.name for path in self.inputs) or "this command"


_of_work: ContextVar[FilesOfWork | None] = ContextVar("hdopt_files_of_work", default=None)


@contextmanager
def watching_files() -> Iterator[FilesOfWork]:
    """Note which files are read and written meanwhile; an output that is an input is refused."""
    work = FilesOfWork()
    token = _of_work.set(work)
    try:
        yield work
    finally:
        _of_work.reset(token)


def files_of_work() -> FilesOfWork | None:
    """The files of the work under way, where they are watched."""
    return _of_work.get()


def note_input(path: Path, content: bytes | None = None) -> None:
    """Say that `path` is read (`content`: what was in it, where that is at hand): it can then be no output."""
    work = _of_work.get()
    if work is None:
        return
    import hashlib

    real = _real(path)
    if real in work.outputs:
        raise HdoptError(f"{path} is read and was also given as an output; give the output another name")
    if content is None:
        if real.is_dir():
            for inside in sorted(real.iterdir()):
                note_input(inside)
            return
        try:
            with open(path, "rb") as file:
                work.inputs[real] = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError:
            work.inputs[real] = ""
    else:
        work.inputs[real] = hashlib.sha256(content).hexdigest()


def read_text(path: Path, wanted: str, foreign: bool = False) -> str:
    """The text of the UTF-8 file `path`; `wanted` says in messages what to give instead, as 'a study file'.

    A `foreign` file, that an instrument or a spreadsheet wrote, may also be UTF-16 with its mark, or Windows-1252.
    """
    try:
        with open(path, "rb") as file:
            content = file.read(LARGEST_TEXT + 1)
    except (OSError, ValueError) as error:
        raise HdoptError(f"cannot read {path}: {_why(error)}; give {wanted}") from error
    if len(content) > LARGEST_TEXT:
        raise HdoptError(f"{path} is larger than {LARGEST_TEXT // 2**20} MiB; give {wanted}")
    note_input(path, content)
    utf_16 = foreign and content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        return content.decode("utf-16" if utf_16 else "utf-8-sig")
    except UnicodeDecodeError as error:
        with suppress(UnicodeDecodeError):
            if foreign and not utf_16:
                return content.decode("cp1252")
        line = content.count(b"\n", 0, error.start) + 1
        raise HdoptError(
            f"{path} is not a text file: line {line}, byte {error.start} is not UTF-8; give {wanted}"
        ) from error


DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*")


def cells_of(line: str) -> list[str]:
    """The cells of a `line` of a CSV, cut at semicolons, else at tabs, else at commas, with a point in each number that
    has a decimal comma."""
    separator = next((mark for mark in ";\t" if mark in line), ",")
    try:
        (cells,) = csv.reader([line], delimiter=separator)
    except (csv.Error, ValueError):  # a cell beyond all limits, or a line without any
        cells = line.split(separator)
    return [cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell) else cell for cell in cells]


def are_names(cells: Iterable[str]) -> bool:
    """Whether the `cells` of a line can name columns: none is a number, as in a row whose other cell is spoilt."""
    return not any(map(_is_number, cells))


def on_commas(line: str, cells: Sequence[str], wanted: int) -> str:
    """What to do about a `line` that decimal commas may have cut into more `cells` than the `wanted` ones."""
    several = len(cells) > wanted and not set(";\t") & set(line)
    return "; between decimal commas, semicolons must part the cells" if several else ""


DEEP = 100
"""Brackets open at a time beyond any sound file."""


def line_of(text: str, part: str, start: int = 0) -> int:
    """The line of `text` in which `part` begins, from letter `start` on; the first where it is not in it."""
    return text.count("\n", 0, max(0, text.find(part, max(0, start)))) + 1


def line_of_depth(text: str) -> int:
    """The line of `text` in which more brackets are open than in any sound file; else the last one."""
    depth = line = 1
    for letter in re.findall(r"[\[{\]}\n]", text):
        line += letter == "\n"
        depth += (letter in "[{") - (letter in "]}")
        if depth > DEEP:
            break
    return line


def read_json(path: Path, wanted: str) -> Any:
    """The JSON value in the file `path`; `wanted` says in messages what to give instead. Numbers that are not finite,
    or that no float can hold, are refused; nothing of the content is echoed."""
    text = read_text(path, wanted)

    def refuse(number: str, why: str) -> NoReturn:
        raise HdoptError(f"{path}, line {line_of(text, number)}: {why}; give {wanted}")

    def not_finite(number: str) -> NoReturn:
        refuse(number, f"holds the number {number[:12]}, which is not finite")

    def integer(digits: str) -> int:
        if len(digits.lstrip("-")) > 19:  # the largest seed has 19
            refuse(digits, f"holds an integer of {len(digits)} digits")
        return int(digits)

    def number(digits: str) -> float:
        value = float(digits)
        if not math.isfinite(value):
            not_finite(digits)
        return value

    try:
        return json.loads(text, parse_constant=not_finite, parse_int=integer, parse_float=number)
    except json.JSONDecodeError as error:
        raise HdoptError(f"{path}, line {error.lineno}: is not valid JSON ({error.msg}); give {wanted}") from error
    except RecursionError as error:
        raise HdoptError(f"{path}, line {line_of_depth(text)}: is nested too deeply; give {wanted}") from error


def write_text(path: Path, text: str) -> None:
    """Write `text` to the file `path` whole or not at all, or say in one sentence why that cannot be done."""
    write_bytes(path, text.encode("utf-8", "surrogateescape"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write `content` to the file `path` whole or not at all, or say in one sentence why that cannot be done."""
    with replacing(path) as passing:
        passing.write_bytes(content)


SPREADSHEET_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""How a cell begins that a spreadsheet takes for a formula (OWASP, "CSV Injection")."""


def to_csv(frame: pd.DataFrame, index: bool = False) -> str:
    """CSV text of `frame`, with its index where `index`: texts that a spreadsheet would run as formulas begin with an
    apostrophe, which it hides; numbers stay numbers. Lines end with a line feed."""
    # A cell with a carriage return is only quoted where that ends a line, and unquoted it would cut the line in two.
    return harmless(frame).to_csv(index=index, lineterminator="\r\n").replace("\r\n", "\n")


def harmless(frame: pd.DataFrame) -> pd.DataFrame:
    """`frame` with an apostrophe before every text, in cells, column names and index, that begins like a formula."""
    safe = frame.copy()
    for place, kind in enumerate(safe.dtypes):
        if not (kind.kind in "biufcmM" if hasattr(kind, "kind") else False):
            safe.isetitem(place, [harmless_cell(cell) for cell in safe.iloc[:, place]])
    safe.columns = safe.columns.map(harmless_cell)
    safe.index = safe.index.map(harmless_cell) if len(safe.index) else safe.index
    safe.index.names = [harmless_cell(name) for name in frame.index.names]
    return safe


class HasTables(Protocol):
    """A result with tables for a spreadsheet, by name, the main one first."""

    def tables(self) -> dict[str, pd.DataFrame]: ...


class ShownAsTable:
    """A result that a notebook shows by its main table instead of the text of a record."""

    def to_frame(self) -> pd.DataFrame:
        """The main table."""
        raise NotImplementedError(type(self).__name__)

    def _repr_html_(self) -> str:
        return self.to_frame().to_html(max_rows=20, notebook=True)


def write_tables(result: HasTables, path: str | Path, kind: str | None = None) -> None:
    """Write the tables of a `result` to `path` by `kind`: "xlsx", an Excel workbook of all of them, a sheet each, or
    "csv", the main one; by the ending of `path` if None.

    Whole or not at all; texts that begin like formulas are made harmless, numbers stay numbers. Raises `HdoptError` for
    another kind, and where the file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lower().lstrip(".") if kind is None else kind
    check_output(path)
    if kind == "xlsx":
        write_bytes(path, to_xlsx(result.tables()))
    elif kind == "csv":
        write_text(path, to_csv(next(iter(result.tables().values()))))
    else:
        raise HdoptError(f"cannot write {path}: tables are written as .csv or .xlsx; give one of these endings")


def to_xlsx(tables: Mapping[str, pd.DataFrame]) -> bytes:
    """An Excel workbook of `tables`, a sheet each by its name, with a bold head that stays while the rest scrolls."""
    import io

    import pandas as pd

    content = io.BytesIO()
    with pd.ExcelWriter(content, engine="openpyxl") as book:
        for name, frame in tables.items():
            sheet = _NOT_IN_SHEET_NAMES.sub(" ", _without_controls(name))[:LONGEST_SHEET_NAME].strip("' ") or "table"
            printable = frame.map(_without_controls).rename(columns=_without_controls)
            harmless(printable).to_excel(book, sheet_name=sheet, index=False, freeze_panes=(1, 0))
            for column in book.sheets[sheet].columns:
                widest = max(len(str(cell.value)) for cell in column if cell.value is not None)
                book.sheets[sheet].column_dimensions[column[0].column_letter].width = min(max(widest + 2, 8), 60)
    return content.getvalue()


LONGEST_SHEET_NAME = 31
"""Letters of a sheet's name that Excel takes; it takes none of []:*?/\\."""


def _without_controls(cell: Any) -> Any:
    """A text `cell` without what XML cannot hold, such as control characters; anything else as it is."""
    return _CONTROLS.sub(" ", cell) if isinstance(cell, str) else cell


_CONTROLS = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
_NOT_IN_SHEET_NAMES = re.compile(r"[\[\]:*?/\\\t\r\n]")


def harmless_cell(cell: Any) -> Any:
    """A text `cell` that begins like a formula, with an apostrophe before it; anything else as it is."""
    if isinstance(cell, str) and cell.startswith(SPREADSHEET_FORMULA) and not _is_number(cell):
        return "'" + cell
    return cell


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A passing name in the folder of `path`, for a writer that opens files itself.

    What stands under it at the end reaches the disk and takes the place of `path`; where anything fails, and on Ctrl-C
    and SIGTERM too, `path` stays as it was and the passing file goes. Raises `HdoptError` for what cannot be written.
    """
    with replacing_all((path,)) as (passing,):
        yield passing


@contextmanager
def replacing_all(paths: Iterable[Path]) -> Iterator[list[Path]]:
    """The same for several `paths` that belong together: all take their names, or none does."""
    targets = list(paths)
    for path in targets:
        check_output(path)
    reals = {path: _real(path) for path in targets}
    passing = {path: _passing_name(real) for path, real in reals.items()}
    noted = interruption()
    before = len(noted.came)
    _under_way.update(passing.values())
    try:
        for path in targets:
            _create(passing[path], reals[path])
        yield [passing[path] for path in targets]
        if len(noted.came) > before:
            raise noted.came[-1]  # a signal that compiled code swallowed
        _finish(targets, passing, reals)
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            raise
        meant = [path for path in targets if error.filename in (str(passing[path]), str(reals[path]))] or targets
        remedy = "make room there" if error.errno in FULL else "give a file in a folder that can be written"
        raise HdoptError(f"cannot write {', '.join(map(str, meant))}: {_why(error)}; {remedy}") from error
    finally:
        with _signals_wait():
            _drop(passing.values())


_under_way: set[Path] = set()
"""Passing names that may stand on disk."""


def drop_passing_files() -> None:
    """Remove what stands under passing names, before a process ends at once and leaves no time for it."""
    _drop(tuple(_under_way))


def _drop(names: Iterable[Path]) -> None:
    for name in names:
        with suppress(OSError):
            name.unlink(missing_ok=True)
        _under_way.discard(name)


names_change = threading.RLock()
"""Held while files take their names, which the end of the process would leave half done."""


@contextmanager
def _signals_wait() -> Iterator[None]:
    """SIGINT and SIGTERM come at the end of the block instead of within it, where this thread is the one they reach."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    handlers = {}
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) not in (None, signal.SIG_IGN):
                handlers[number] = signal.signal(number, lambda number, frame: came.append(number))
        with names_change:
            yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for late in came:
            signal.raise_signal(late)


def is_special(path: Path) -> bool:
    """Whether `path` is a device, pipe or socket, which is written to and never replaced."""
    if str(path).startswith(STREAMS):
        return True
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return False
    return not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)


def _passing_name(real: Path) -> Path:
    folder = Path(tempfile.gettempdir()) if is_special(real) else real.parent
    return folder / f".{real.name[:120]}.{os.getpid()}-{secrets.token_hex(4)}{PASSING}{real.suffix[:20]}"


def _create(passing: Path, real: Path) -> None:
    """An empty passing file with the rights that the old file has, or that a new one would get."""
    os.close(os.open(passing, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    if real.is_file():
        passing.chmod(stat.S_IMODE(real.stat().st_mode))


def _finish(targets: Sequence[Path], passing: Mapping[Path, Path], reals: Mapping[Path, Path]) -> None:
    """Give the `passing` files the names of their `targets`, once all of them have reached the disk."""
    files = [path for path in targets if not is_special(path)]
    for path in files:
        with open(passing[path], "rb") as file:
            os.fsync(file.fileno())
    for path in targets:
        if path not in files:
            _pass_on(passing[path], path)
    work = _of_work.get()
    with _signals_wait():
        for path in files:
            os.replace(passing[path], reals[path])
            if work is not None and reals[path] in work.outputs:
                work.written.append(work.outputs[reals[path]])
    for folder in dict.fromkeys(reals[path].parent for path in files):
        sync_folder(folder)


def _pass_on(content: Path, path: Path) -> None:
    """Write the `content` of a file to the device, pipe or socket at `path`. A pipe without a reader is refused:
    opening it would wait for one, perhaps for ever."""
    is_stream = str(path).startswith(STREAMS)
    try:
        handle = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
    except OSError as error:
        if error.errno != errno.ENXIO or not stat.S_ISFIFO(path.stat().st_mode):
            raise
        if is_stream:
            raise BrokenPipeError from error
        raise HdoptError(
            f"cannot write {path}: it is a pipe that nothing reads; start its reader first, or give a file"
        ) from error
    with open(handle, "wb") as device:
        os.set_blocking(handle, True)
        device.write(content.read_bytes())


def sync_folder(folder: Path) -> None:
    """Let the names in a folder reach the disk, where the system can."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def check_output(path: Path) -> None:
    """Raise `HdoptError` where `path` cannot be written, before any work is done for it.

    It must be no folder and no input of this work, and its folder must exist and be writable.
    """
    try:
        real = _real(path)
        name = real.name
        if real.is_dir() or str(path).endswith(os.sep) or not name:
            raise HdoptError(f"cannot write {path}: it is a folder; give the name of a file")
        if is_special(real):
            if not os.access(real, os.W_OK):
                raise HdoptError(f"cannot write {path}: permission denied; give a file that can be written")
            return
        if real.is_symlink():
            raise HdoptError(f"cannot write {path}: the link leads nowhere; give the name of a file")
        if len(os.fsencode(name)) > 255 or "\0" in str(path):
            raise HdoptError(f"cannot write {path}: the name is too long or not one; give a shorter name")
        if not real.parent.is_dir():
            raise HdoptError(
                f"cannot write {path}: there is no folder {real.parent}; give a file in a folder that exists and "
                "can be written"
            )
        if not os.access(real.parent, os.W_OK | os.X_OK):
            raise HdoptError(f"cannot write {path}: its folder cannot be written; give a file in one that can")
    except (OSError, ValueError, RuntimeError) as error:
        if isinstance(error, HdoptError):
            raise
        raise HdoptError(f"cannot write {path}: {_why(error)}; give a file in a folder that can be written") from error
    work = _of_work.get()
    if work is not None and real in work.inputs:
        raise HdoptError(f"{path} is an input of this command; give the output another name")


def claim_output(path: Path) -> None:
    """Check the output `path`, to be written later; a later input or second output of that name is refused."""
    check_output(path)
    work = _of_work.get()
    if work is None or is_special(path):
        return
    real = _real(path)
    if real in work.outputs:
        raise HdoptError(f"{path} is given for two outputs; give each a name of its own")
    work.outputs[real] = path


def make_folder(path: Path) -> None:
    """Make the folder `path`, its parents too, or say in one sentence why that cannot be done."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        remedy = "make room there" if getattr(error, "errno", None) in FULL else "give a folder that can be made"
        raise HdoptError(f"cannot make the folder {path}: {_why(error)}; {remedy}") from error


def _real(path: Path) -> Path:
    """The file that a name means in the end; a stream of this process stays as it is."""
    return path if is_special(path) else Path(os.path.realpath(path))


def _why(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
