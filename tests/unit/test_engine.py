"""The one executor: order kept, memory bounded, the same bytes on every engine, a cluster's faults told in time."""

import errno
import json
import os
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import hdopt.parallel.cluster
from hdopt.errors import EngineFailed, HdoptError
from hdopt.parallel.cluster import Dask
from hdopt.parallel.engine import engine_from, engine_in_force
from hdopt.parallel.local import Processes, ThisProcess, Threads
from hdopt.parallel.shared_memory import each, in_blocks, in_parts, threads_for
from hdopt.parallel.workers import cores, in_a_worker
from hdopt.tolerance.distributions import Normal
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.stack import StackRequest, run_stack
from hdopt.tolerance.tail import tail_probability
from tests.machine import gives_semaphores, needs_semaphores


def total(x):
    return x.sum(axis=1)


def slowest_first(i):
    time.sleep(0.02 if i % 4 == 0 else 0)
    return i * i


SPACE = InputSpace({name: Tolerance(Normal(std=1.0)) for name in ("x", "y")})


def stacked(engine):
    return run_stack(total, SPACE, StackRequest(limit=3.0, n=4096, seed=0, engine=engine)).to_dict()


@pytest.fixture(scope="module")
def two_processes():
    return Processes(2)


@pytest.mark.parametrize("engine", [ThisProcess(), Threads(1), Threads(4)])
def test_results_come_in_order(engine):
    assert list(engine.map(slowest_first, range(50))) == [i * i for i in range(50)]


@needs_semaphores
def test_processes_keep_order_and_bytes():
    assert list(Processes(2).map(lambda i: i * i, range(20))) == [i * i for i in range(20)]
    assert stacked(Processes(2)) == stacked("process")
    assert tail(Processes(2)) == tail("process") == tail("threads:3")


def test_a_machine_without_semaphores_is_told_to_use_threads(monkeypatch):
    """As on one whose /dev/shm cannot be written."""

    def no_lock(*_, **__):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr("multiprocessing.synchronize.SemLock.__init__", no_lock)
    with pytest.raises(EngineFailed, match=r"semaphores.*\(Read-only file system\).*/dev/shm.*--engine threads"):
        list(Processes(2).map(abs, [1, 2]))
    assert not gives_semaphores()


def test_threads_give_the_bytes_of_one_process():
    assert stacked("threads:3") == stacked("process")


def test_no_more_than_a_few_items_are_under_way():
    taken = []

    def items():
        for i in range(100):
            taken.append(i)
            yield i

    first = Threads(2).map(lambda i: i, items())
    assert next(first) == 0
    assert len(taken) <= 4


def test_what_a_worker_calls_runs_in_turn():
    """Cores are shared out once: threads of threads would be four times as many as cores."""

    def nested(i):
        own = threading.current_thread().name
        return in_a_worker(), threads_for(100), own, list(Threads(8).map(lambda j: threading.get_ident(), [i, i]))

    def whose(i):
        return threading.current_thread().name, nested(i), threading.get_ident()

    for name, (inside, threads, own, idents), ident in Threads(2).map(whose, range(4)):
        assert inside and threads == 1 and own == name and name.startswith("hdopt")
        assert idents == [ident, ident]  # the worker's own thread, not one of eight more that happens to be quick
    assert not in_a_worker()


def test_workers_of_the_tests_have_one_thread_each():
    """Would catch an engine in force that ends where its name is let go: two workers with two threads each."""
    beside_others = "PYTEST_XDIST_WORKER" in os.environ
    assert isinstance(engine_from(None), ThisProcess if beside_others else Threads)


def test_one_process_means_one_thread():
    with engine_in_force("process"):
        assert threads_for(1000) == 1
        assert each(lambda i: threading.current_thread() is threading.main_thread(), range(4)) == [True] * 4
    with engine_in_force("threads"):
        assert threads_for(1000) == cores()


@pytest.mark.parametrize("engine", ["process", "threads:2", "threads:5"])
@pytest.mark.parametrize("rows", [0, 1, 7, 8, 100, 1001])
def test_blocks_and_parts_cover_every_row_once(engine, rows):
    counts = np.zeros((2, rows), int)

    def fill(kind):
        def work(part):
            counts[kind, part] += 1

        return work

    with engine_in_force(engine):
        in_blocks(rows, 8, fill(0))
        in_parts(rows, fill(1))
    assert (counts == 1).all()


LATER = """
from hdopt.parallel.workers import one_linear_algebra_thread
with one_linear_algebra_thread():
    pass
import sys
import numpy, scipy.linalg
from threadpoolctl import threadpool_info
with one_linear_algebra_thread():
    print([library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"])
"""


def test_a_library_that_comes_later_has_one_thread_too():
    """Would catch libraries found once and kept: SciPy brings its own, after the first pool has run."""
    many = {**os.environ, "OPENBLAS_NUM_THREADS": "2"}
    done = subprocess.run([sys.executable, "-c", LATER], capture_output=True, text=True, check=True, env=many)
    assert set(json.loads(done.stdout)) == {1}, done.stdout


def test_linear_algebra_has_one_thread_where_pools_run():
    threadpoolctl = pytest.importorskip("threadpoolctl")

    def blas_threads(_):
        return max(pool["num_threads"] for pool in threadpoolctl.threadpool_info() if pool["user_api"] == "blas")

    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        for engine in (ThisProcess(), Threads(2)):
            assert list(engine.map(blas_threads, range(3))) == [1, 1, 1]
        assert blas_threads(None) == min(2, cores()) or blas_threads(None) == 2


def test_the_error_of_an_item_comes_through_and_stops_the_rest():
    started = []

    def work(i):
        started.append(i)
        if i == 3:
            raise HdoptError("item three")
        time.sleep(0.005)

    with pytest.raises(HdoptError, match="item three"):
        list(Threads(2).map(work, range(1000)))
    assert len(started) < 20


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("threads:0", "give 1 to 1024 workers"),
        ("threads:", "give 1 to 1024 workers"),
        ("processes:99999999999999999999", "give 1 to 1024 workers"),
        ("dask://host", "names no scheduler; write dask://HOST:PORT"),
        ("dask://host:99999999999", "names no scheduler"),
        ("treads", "did you mean 'threads'"),
    ],
)
def test_names_of_engines_that_are_none(name, message):
    with pytest.raises(HdoptError, match=message):
        engine_from(name)


def test_dask_cluster_gives_the_same_numbers():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        engine = Dask(cluster.scheduler_address.removeprefix("tcp://"))
        assert stacked(engine) == stacked("process")


def tail(engine):
    """Of the sum of two normals, slow enough that two simulations at once would overlap."""

    def response(x):
        time.sleep(1e-4)
        return x.sum(axis=1)

    return tail_probability(response, SPACE, 4.0, seed=0, replicates=6, level_size=1000, engine=engine)


class Elsewhere(ThisProcess):
    """An engine that says it leaves this process, and counts what it gets."""

    elsewhere = True
    got = 0

    def map(self, function, items):
        items = list(items)
        Elsewhere.got = len(items)
        return super().map(function, items)


def test_a_tail_gives_each_of_its_simulations_to_the_engine():
    assert tail(Elsewhere()) == tail("process")
    assert Elsewhere.got == 6


def test_a_tail_has_the_same_numbers_on_two_threads_of_one_dask_worker():
    """Would catch two simulations that draw from OpenTURNS' one stream a process at the same time."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        assert tail(Dask(cluster.scheduler_address.removeprefix("tcp://"))) == tail("process")


def test_no_scheduler_is_one_sentence():
    with pytest.raises(HdoptError, match=r"no Dask scheduler answers at 127\.0\.0\.1:1"):
        list(Dask("127.0.0.1:1", timeout_s=0.5).map(total, [1]))


def test_a_mute_listener_is_told_within_the_time_out():
    with socket.create_server(("127.0.0.1", 0)) as mute:
        began = time.monotonic()
        with pytest.raises(HdoptError, match="is no Dask scheduler of this version"):
            list(Dask(f"127.0.0.1:{mute.getsockname()[1]}", timeout_s=0.5).map(total, [1]))
        assert time.monotonic() - began < 5


STREAMED = """
from pathlib import Path
from hdopt.tolerance.distributions import Uniform
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.sampling import PlainMonteCarlo
from hdopt.tolerance.stack import StackRequest, run_stack
from hdopt.tolerance.tail import tail_probability
space = InputSpace({"x": Tolerance(Uniform(lower=0.0, upper=1.0))})
request = StackRequest(limit=0.9, n=COUNT, seed=0, engine="process", sampling=PlainMonteCarlo())
run_stack(lambda x: x[:, 0], space, request)
# Not getrusage: its peak is carried over from the process that started this one.
status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
print(status["VmHWM"].split()[0])
"""


def peak_kib(n):
    code = STREAMED.replace("COUNT", str(n))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return int(done.stdout)


@pytest.mark.slow
def test_memory_of_a_streamed_stack_does_not_grow_with_n():
    """Beyond 2^24 values are counted, not kept: what holds for 4e7 holds for 1e9. 10 % is what allocators vary; values
    that are kept would be 160 MB more, half as much again."""
    small, large = peak_kib(2 * 10**7), peak_kib(4 * 10**7)
    assert large < 1.1 * small
    assert large < 2**20  # 1 GiB


def exits(i):
    import os

    os._exit(1)


def slow_square(i):
    time.sleep(0.15)
    return i * i


@pytest.fixture(scope="module")
def cluster():
    """A real scheduler and two workers, each a process, on this machine only."""
    distributed = pytest.importorskip("distributed")
    import dask

    # Work that kills two workers kills the next one too; Dask tries four before it says so, seconds each.
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None, silence_logs=50
        ) as cluster,
    ):
        yield cluster


@needs_semaphores
@pytest.mark.slow
def test_a_killed_worker_changes_nothing(cluster):
    engine = Dask(cluster.scheduler_address.removeprefix("tcp://"))
    assert stacked(engine) == stacked("process")
    found = iter(engine.map(slow_square, range(40)))
    first = [next(found) for _ in range(3)]
    next(iter(cluster.workers.values())).process.process.kill()
    assert first + list(found) == [i * i for i in range(40)]


@needs_semaphores
@pytest.mark.slow
def test_work_that_kills_every_worker_is_one_message(cluster):
    engine = Dask(cluster.scheduler_address.removeprefix("tcp://"))
    with pytest.raises(HdoptError, match="died over the same piece of work, for want of memory most likely"):
        list(engine.map(exits, range(2)))


@needs_semaphores
@pytest.mark.slow
def test_a_scheduler_without_workers_or_with_others_is_told_within_the_time_out(monkeypatch):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=None, silence_logs=50) as empty:
        engine = Dask(empty.scheduler_address.removeprefix("tcp://"), timeout_s=2.0)
        began = time.monotonic()
        with pytest.raises(HdoptError, match="has had no workers for 2 s; start some with 'dask worker tcp://"):
            list(engine.map(abs, [1]))
        assert time.monotonic() - began < 8
        empty.scale(1)
        empty.wait_for_workers(1)
        here = hdopt.parallel.cluster.versions()
        monkeypatch.setattr("hdopt.parallel.cluster.versions", lambda: {**here, "hdopt": "9.9"})
        monkeypatch.setattr("hdopt.parallel.cluster._versions_there", lambda client: {"tcp://w": here})
        with pytest.raises(HdoptError, match=r"the worker tcp://w has hdopt .*, here it is 9\.9; install the same"):
            list(engine.map(abs, [1]))


@needs_semaphores
@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_told():
    distributed = pytest.importorskip("distributed")
    # One that is closed twice fails in Dask itself, so no `with`.
    cluster = distributed.LocalCluster(n_workers=1, host="127.0.0.1", dashboard_address=None, silence_logs=50)
    engine = Dask(cluster.scheduler_address.removeprefix("tcp://"), timeout_s=3.0)
    found = iter(engine.map(slow_square, range(1000)))
    next(found)
    closing = threading.Thread(target=cluster.close, daemon=True)
    closing.start()
    began = time.monotonic()
    with pytest.raises(HdoptError, match="was lost in the middle of the work|has had no workers"):
        list(found)
    assert time.monotonic() - began < 30
    closing.join(30)
