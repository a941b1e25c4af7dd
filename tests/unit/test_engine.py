"""Engines: order kept, memory bounded, a real Dask scheduler gives the same numbers."""

import subprocess
import sys

import pytest

from hdopt.engine import Dask, ThisProcess, Threads
from hdopt.errors import HdoptError
from hdopt.tolerance.distributions import Normal
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.stack import run_stack


def total(x):
    return x.sum(axis=1)


@pytest.mark.parametrize("engine", [ThisProcess(), Threads(1), Threads(4)])
def test_results_come_in_order(engine):
    assert list(engine.map(lambda i: i * i, range(50))) == [i * i for i in range(50)]


def test_dask_cluster_gives_the_same_numbers():
    distributed = pytest.importorskip("distributed")
    space = InputSpace({name: Tolerance(Normal(std=1.0)) for name in ("x", "y")})
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        engine = Dask(cluster.scheduler_address.removeprefix("tcp://"))
        there = run_stack(total, space, limit=3.0, n=4096, seed=0, engine=engine)
    assert there.to_dict() == run_stack(total, space, limit=3.0, n=4096, seed=0, engine="process").to_dict()


def test_no_scheduler_is_one_sentence():
    with pytest.raises(HdoptError, match=r"no Dask scheduler answers at 127\.0\.0\.1:1"):
        list(Dask("127.0.0.1:1", timeout_s=0.5).map(total, [1]))


STREAMED = """
from pathlib import Path
from hdopt.tolerance.distributions import Uniform
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.sampling import PlainMonteCarlo
from hdopt.tolerance.stack import run_stack
space = InputSpace({"x": Tolerance(Uniform(lower=0.0, upper=1.0))})
run_stack(lambda x: x[:, 0], space, limit=0.9, n=COUNT, seed=0, engine="process", sampling=PlainMonteCarlo())
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
    """Beyond 2^24 values are counted, not kept: what holds for 1.5e8 holds for 1e9. 10 % is what allocators vary."""
    small, large = peak_kib(2 * 10**7), peak_kib(15 * 10**7)
    assert large < 1.1 * small
    assert large < 2**20  # 1 GiB
