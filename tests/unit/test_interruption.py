"""SIGINT and SIGTERM: wherever the exception gets lost, the command ends soon, and says one line."""

import _imp
import ctypes
import os
import signal
import sys
import threading
import time
import weakref
from contextlib import suppress
from importlib.machinery import ExtensionFileLoader, ModuleSpec
from types import ModuleType

import pytest

from hdopt.cli import main, signals
from hdopt.interruption import Interruption, answering_interruptions, interruption
from hdopt.parallel.local import Processes

ENOUGH_S = 30.0
"""What a lost interruption may take on a busy machine; it is sent again after 50 ms, and the work lasts twice that."""


def arrive(number):
    os.kill(os.getpid(), number)
    for _ in range(100):  # the handler runs between two steps of Python
        pass


def in_a_destructor(number):
    class Dropped:
        def __del__(self):
            arrive(number)

    Dropped()


def in_a_weak_reference(number):
    class Gone:
        pass

    gone = Gone()
    kept = weakref.ref(gone, lambda _: arrive(number))
    del gone
    assert kept() is None


def in_a_callback_of_c(number):
    compare = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(lambda a, b: arrive(number) or 0)
    ctypes.CDLL(None).qsort((ctypes.c_int * 2)(), 2, 4, compare)


def in_a_bare_except(number):
    try:
        arrive(number)
    except BaseException:
        return


def in_an_except_that_raises_another(number):
    try:
        try:
            arrive(number)
        except BaseException as error:
            raise ValueError("initialization failed") from error
    except ValueError:
        return


LOST = [
    in_a_destructor,
    in_a_weak_reference,
    in_a_callback_of_c,
    in_a_bare_except,
    in_an_except_that_raises_another,
]


@pytest.fixture
def command(monkeypatch, capfd):
    """Runs `work` as a command of this process; its exit status, seconds and what stands on standard error."""
    monkeypatch.setattr(signals, "AGAIN_S", 0.05)
    monkeypatch.setattr(sys, "unraisablehook", sys.__unraisablehook__)  # pytest's own prints nothing
    before = signal.signal(signal.SIGINT, signal.default_int_handler)

    def run(work):
        monkeypatch.setattr("hdopt.cli._run", lambda arguments: work() or 0)
        began = time.monotonic()
        with pytest.raises(SystemExit) as ended:
            main(["studies"])
        return ended.value.code, time.monotonic() - began, capfd.readouterr().err

    yield run
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("lost", LOST, ids=lambda lost: lost.__name__)
def test_wherever_an_interruption_gets_lost_the_command_ends_soon(command, lost, number, status):
    """Would catch an exception that is raised once and lost, after which the work went on to its end, and the traceback
    that Python prints of one that is lost in a destructor or a callback."""

    def work():
        lost(number)
        until = time.monotonic() + 2 * ENOUGH_S
        while time.monotonic() < until:
            time.sleep(0.01)

    hooks = sys.excepthook, sys.unraisablehook, threading.excepthook
    code, took, said = command(work)
    assert (code, said) == (status, f"hdopt: {'interrupted' if status == 130 else 'ended by SIGTERM'}\n")
    assert took < ENOUGH_S
    assert hooks == (sys.excepthook, sys.unraisablehook, threading.excepthook)


@pytest.mark.parametrize("step", ["create_dynamic", "exec_dynamic"])
def test_nothing_is_raised_into_a_compiled_module_that_is_imported(command, monkeypatch, step):
    """Would catch the crash of a library whose start does not expect an exception: an export that loads its solids'
    library. What comes meanwhile ends the command once the module is there."""
    loaded = []

    def load(module, *_):
        arrive(signal.SIGINT)
        loaded.append(module)
        return module

    def work():
        loader = ExtensionFileLoader("compiled", "compiled.so")
        with monkeypatch.context() as patch:
            patch.setattr(_imp, step, load)
            if step == "create_dynamic":
                loader.create_module(ModuleSpec("compiled", loader))
            else:
                loader.exec_module(ModuleType("compiled"))
        until = time.monotonic() + 2 * ENOUGH_S
        while time.monotonic() < until:
            time.sleep(0.01)

    code, took, _ = command(work)
    assert (code, len(loaded)) == (130, 1)
    assert took < ENOUGH_S


def test_clean_up_is_not_interrupted_again(command):
    """Would catch a second Ctrl-C, or the signal sent again, that leaves clean-up half done: in `finally`, in a
    handler of its own and in what either calls."""
    done = []

    def clean():
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGINT)
            try:
                raise OSError
            except OSError:
                time.sleep(0.1)
        done.append("cleaned")

    def work():
        try:
            try:
                arrive(signal.SIGINT)
            finally:
                clean()
        except KeyboardInterrupt:
            clean()
            raise

    assert command(work)[0] == 130
    assert done == ["cleaned", "cleaned"]


def test_what_answers_an_interruption_is_left_alone(command):
    """Would catch a search that is interrupted again while it works out the best so far, and after that."""
    kept = []

    def work():
        with answering_interruptions():
            in_a_bare_except(signal.SIGINT)
            time.sleep(0.2)
        kept.append(list(interruption().came))
        time.sleep(0.2)

    assert command(work)[0] == 0
    assert kept == [[]]


def test_work_that_never_comes_back_is_ended_for_good(monkeypatch):
    """Would catch a process that waits in compiled code, where no exception arrives, for as long as that takes."""
    monkeypatch.setattr(signals, "AGAIN_S", 0.3)
    monkeypatch.setattr(signals, "GRACE_S", 0.1)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    ended = threading.Event()
    try:
        with suppress(KeyboardInterrupt), signals.signals_raise(Interruption(), lambda came: ended.set()):
            in_a_bare_except(signal.SIGINT)
            mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])  # as good as compiled code
            ended.wait(ENOUGH_S)
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended.is_set()


def masked(_):
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_a_worker_process_is_deaf_to_ctrl_c_before_its_first_line():
    """A terminal sends Ctrl-C to the workers too: one that is still importing would print its own traceback."""
    assert list(Processes(1).map(masked, [0])) == [True]
    assert not masked(0)
