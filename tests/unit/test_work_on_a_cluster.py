"""Every kind of long work leaves this process where --engine says so, and answers with the same bytes from there.

Stacks and tails are in test_engine, searches in test_optimize_search, batches in test_inspect and test_diagnose_many.
"""

import json
from dataclasses import dataclass, field

import pytest

import hdopt
from hdopt.parallel.cluster import Dask
from hdopt.parallel.engine import Engine, engine_in_force
from hdopt.parallel.local import ThisProcess
from hdopt.study import load_study
from hdopt.workflow.steps import Context, find_step

LINEAR = "chase-shaft-housing"
VERIFIED = ("allocate.verify_n=16384", "allocate.curve=[]")
SMALL = ("concealed.share=0.007", 'concealed.families=["nothing"]', "concealed.seed=2001")


class Answer:
    """A diagnosis that takes no time, and says what it was asked."""

    def __init__(self, recordings):
        self.rows = sum(len(recording.input_angle) for recording in recordings)

    def to_dict(self):
        return {"schema": 1, "verdict": "adequate", "effects": [], "rows": self.rows}


def concealed(folder):
    return find_step("concealed_physics")(load_study("concealed-physics", SMALL), Context(folder)).results


WORK = {
    "sobol": lambda folder: hdopt.sobol(LINEAR, 2**8).to_dict(),
    "shapley": lambda folder: hdopt.sobol(LINEAR, 2**8, shapley="inputs", second_order=False).to_dict(),
    "screening": lambda folder: hdopt.screen(LINEAR, "morris", 2**8).to_dict(),
    "allocation": lambda folder: hdopt.allocate(load_study(LINEAR, VERIFIED), compare=False).to_dict(),
    "concealed bench": concealed,
}


@dataclass(frozen=True)
class Counting:
    """An engine that counts the items it was given."""

    engine: Engine
    items: list = field(default_factory=list)
    elsewhere: bool = True
    threads: int = 1

    def map(self, function, items):
        self.items.extend(items := list(items))
        return self.engine.map(function, items)


@pytest.fixture(scope="module")
def dask():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        yield Dask(cluster.scheduler_address.removeprefix("tcp://"))


@pytest.mark.parametrize("name", WORK)
def test_work_goes_to_the_cluster_and_comes_back_the_same(name, dask, tmp_path, monkeypatch):
    """Would catch work that stays here whatever the engine, and a function or a result that cannot travel."""
    monkeypatch.setattr("hdopt.diagnosis.diagnose", lambda recordings, *others, **options: Answer(recordings))
    found = []
    for engine in (ThisProcess(), Counting(dask)):
        with engine_in_force(engine):
            found.append(json.dumps(WORK[name](tmp_path), default=str, sort_keys=True))
    assert found[0] == found[1]
    assert engine.items
