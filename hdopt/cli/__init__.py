"""The command line. `main` answers every ending of a command; the commands are in `hdopt.cli.app`."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import NoReturn

from hdopt.cli.signals import Terminated, signals_raise
from hdopt.interruption import Interruption, noting_interruptions

DONE, UNUSABLE, INTERRUPTED, TERMINATED = 0, 2, 130, 143
"""Exit statuses besides 1, which is an answer: "no"."""


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit: unusable input ends with one message and status 2, never a traceback.

    `arguments` stand in for those of the process. HDOPT_TRACEBACK=1 in the environment shows where a fault arose.
    """
    _open_streams()
    noted = Interruption()
    try:
        with noting_interruptions() as noted, signals_raise(noted, _end if arguments is None else None):
            status = _run(arguments)
            sys.stdout.flush()
    except (KeyboardInterrupt, Terminated) as came:
        _leave(came, at_once=arguments is None)
    except BrokenPipeError:
        _drop_output()
        sys.exit(DONE)
    except Exception as error:
        _leave_if_interrupted(error, noted.came, at_once=arguments is None)
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


def _run(arguments: Sequence[str] | None) -> int:
    import warnings

    import click

    from hdopt.cli.app import cli
    from hdopt.errors import numbers_of
    from hdopt.files import watching_files
    from hdopt.moment import moment

    moment()  # Where the environment's is unusable, before any work.
    if not os.environ.get("HDOPT_TRACEBACK"):
        # Results are checked to be finite where they are made; NumPy's own lines would stand beside the one message.
        warnings.filterwarnings("ignore", category=RuntimeWarning)
    try:
        with watching_files() as work, numbers_of(work.place_of_numbers):
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


def _ending(came: BaseException) -> tuple[int, str]:
    """Exit status and message after what a signal raised."""
    return (TERMINATED, "ended by SIGTERM") if isinstance(came, Terminated) else (INTERRUPTED, "interrupted")


def _leave(came: BaseException, at_once: bool) -> NoReturn:
    """End after an interruption. A process of our own ends `at_once`: threads under way and the unloading of compiled
    libraries, which an interruption may have left in any state, are not waited for."""
    status, message = _ending(came)
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


def _end(came: BaseException) -> None:
    """The same, from another thread than the interrupted one, which does not come back."""
    from hdopt.files import drop_passing_files, names_change

    status, message = _ending(came)
    with names_change:
        with suppress(OSError):
            os.write(2, f"hdopt: {message}\n".encode())
        drop_passing_files()
        os._exit(status)


def _leave_if_interrupted(error: Exception, came: Sequence[BaseException], at_once: bool) -> None:
    """End as on an interruption where one `came` or is what `error` came from: a compiled library that is interrupted,
    in a callback or while it is imported, raises an error of its own."""
    hidden = list(came)
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, KeyboardInterrupt | Terminated):
            hidden.append(cause)
        cause = cause.__cause__ or cause.__context__
    if hidden:
        _leave(hidden[-1], at_once)


def _drop_broken_output(error: Exception) -> None:
    """Where standard output itself cannot be written (a full disk), nothing more is tried at the end."""
    if isinstance(error, OSError) and error.filename is None:
        _drop_output()


def _drop_output() -> None:
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
