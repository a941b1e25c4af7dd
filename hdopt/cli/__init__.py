"""The command line. `main` answers every ending of a command; the commands are in `hdopt.cli.app`."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

DONE, UNUSABLE, INTERRUPTED, TERMINATED = 0, 2, 130, 143
"""Exit statuses besides 1, which is an answer: "no"."""


class Terminated(BaseException):
    """SIGTERM came: whatever is half-written is cleaned up on the way out, as on Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit: unusable input ends with one message and status 2, never a traceback.

    `arguments` stand in for those of the process. HDOPT_TRACEBACK=1 in the environment shows where a fault arose.
    """
    _open_streams()
    came: list[BaseException] = []
    try:
        with _signals_raise(came):
            status = _run(arguments, came)
            sys.stdout.flush()
    except KeyboardInterrupt:
        _leave(INTERRUPTED, "interrupted", at_once=arguments is None)
    except Terminated:
        _leave(TERMINATED, "ended by SIGTERM", at_once=arguments is None)
    except BrokenPipeError:
        _drop_output()
        sys.exit(DONE)
    except Exception as error:
        _leave_if_interrupted(error, came, at_once=arguments is None)
        if os.environ.get("HDOPT_TRACEBACK"):
            raise
        _drop_broken_output(error)
        _say(_message(error))
        sys.exit(UNUSABLE)
    sys.exit(status)


def _open_streams() -> None:
    """Nothing in place of what the caller closed (`>&-`, some schedulers of jobs): the first file that is opened would
    else take its number, and get what is printed."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free: this one
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")


def _run(arguments: Sequence[str] | None, came: list[BaseException]) -> int:
    import warnings

    import click

    from hdopt.cli.app import cli
    from hdopt.errors import numbers_of
    from hdopt.files import watching_files

    if not os.environ.get("HDOPT_TRACEBACK"):
        # Results are checked to be finite where they are made; NumPy's own lines would stand beside the one message.
        warnings.filterwarnings("ignore", category=RuntimeWarning)
    try:
        with watching_files() as work, numbers_of(work.place_of_numbers):
            work.came = came
            status = cli.main(args=arguments, prog_name="hdopt", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as help_text:
        help_text.show()
        return UNUSABLE
    except click.Abort:
        raise KeyboardInterrupt from None
    except SystemExit:  # Click's own answer to a closed pipe
        raise BrokenPipeError from None
    return status if isinstance(status, int) else DONE


def _message(error: Exception) -> str:
    """What is wrong, in three lines at most."""
    import click

    from hdopt.errors import HdoptError, in_brief

    if isinstance(error, click.ClickException):
        return in_brief(error.format_message())
    if isinstance(error, HdoptError):
        return in_brief(str(error))
    if isinstance(error, OSError):
        name = f"reading or writing {error.filename}" if error.filename else "writing to standard output"
        return in_brief(f"{name} failed: {error.strerror or error}")
    if isinstance(error, MemoryError):
        return "this needs more memory than there is; ask for fewer samples, or use --engine dask://HOST:PORT"
    kind = type(error).__name__
    return in_brief(f"cannot go on: {kind}: {error}", 2) + "\nHDOPT_TRACEBACK=1 in the environment shows where"


def _say(message: str) -> None:
    with suppress(OSError, ValueError):
        print(f"hdopt: {message}", file=sys.stderr, flush=True)


def _leave(status: int, message: str, at_once: bool) -> NoReturn:
    """End after an interruption. A process of our own ends `at_once`: threads under way and the unloading of compiled
    libraries, which an interruption may have left in any state, are not waited for."""
    if at_once:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    _say(message)
    if at_once:
        from hdopt.files import drop_passing_files

        drop_passing_files()
        with suppress(OSError, ValueError):
            sys.stdout.flush()
        os._exit(status)
    sys.exit(status)


def _leave_if_interrupted(error: Exception, came: Sequence[BaseException], at_once: bool) -> None:
    """End as on an interruption where one `came` or is what `error` came from: a compiled library that is interrupted,
    in a callback or while it is imported, raises an error of its own."""
    hidden = list(came)
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, KeyboardInterrupt | Terminated):
            hidden.append(cause)
        cause = cause.__cause__ or cause.__context__
    if hidden and isinstance(hidden[-1], Terminated):
        _leave(TERMINATED, "ended by SIGTERM", at_once)
    elif hidden:
        _leave(INTERRUPTED, "interrupted", at_once)


@contextmanager
def _signals_raise(came: list[BaseException]) -> Iterator[None]:
    """SIGTERM as an exception, as SIGINT is, so that what is half-written goes; what `came` is noted.
    Only the main thread may ask for that, and a SIGINT that is ignored stays so."""

    def terminate(number: int, frame: FrameType | None) -> None:
        came.append(Terminated())
        raise came[-1]

    def interrupt(number: int, frame: FrameType | None) -> None:
        came.append(KeyboardInterrupt())
        raise came[-1]

    try:
        before = {signal.SIGTERM: signal.signal(signal.SIGTERM, terminate)}
    except ValueError:  # not the main thread
        yield
        return
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        before[signal.SIGINT] = signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _drop_broken_output(error: Exception) -> None:
    """Where standard output itself cannot be written (a full disk), nothing more is tried at the end."""
    if isinstance(error, OSError) and error.filename is None:
        _drop_output()


def _drop_output() -> None:
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
