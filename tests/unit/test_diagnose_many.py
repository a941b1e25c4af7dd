"""Many drives of one type, each diagnosed by itself: as alone, on every engine, beside bad files, interrupted."""

import json
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import hdopt
from hdopt.cli import main
from hdopt.errors import HdoptError
from hdopt.parallel.engine import engine_in_force
from hdopt.parallel.local import ThisProcess

RATIO, TURN = 7.2, 2 * np.pi
GEAR = ("--each", "--drive", "none", "--ratio", str(RATIO))


def run(*arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in arguments])
    return ended.value.code


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Two gears of six turns there and back, one with a wave of 0.3 arcmin, and a file that is no recording."""
    folder = tmp_path_factory.mktemp("many")
    theta = np.r_[there := np.arange(240) * TURN / 40, there[::-1]]
    for seed, size in enumerate((0.0, 0.3)):
        error = size * np.sin(2 * theta) + np.random.default_rng(seed).normal(0, 0.02, len(theta))
        table = {"time_s": np.arange(len(theta)) * 0.02, "input_angle_deg": np.degrees(theta)}
        table["output_angle_deg"] = np.degrees(theta) / RATIO - error / 60
        pd.DataFrame(table).to_csv(folder / f"d{seed}.csv", index=False)
    (folder / "broken.csv").write_text("a,b\n1,2\n")
    return [folder / name for name in ("d0.csv", "broken.csv", "d1.csv")]


def source():
    return hdopt.recorded_drive("none", RATIO)


@pytest.fixture(scope="module")
def batch(files):
    return hdopt.diagnose_many(files, source())


def test_each_is_answered_as_alone_and_a_bad_file_is_a_row(batch, files):
    """Would catch drives fitted together, a seed or a source that is lost, and a bad file that ends the batch."""
    alone = [hdopt.diagnose(file, source()) for file in (files[0], files[2])]
    assert [drive.content for drive in batch.drives] == [alone[0].to_dict(), None, alone[1].to_dict()]
    assert [drive.verdict for drive in batch.drives] == [alone[0].verdict, "", alone[1].verdict]
    assert batch.drives[1].error.startswith("broken.csv") or "broken.csv" in batch.drives[1].error
    assert sum(batch.verdicts.values()) == 2
    named = [effect.id for one in alone for effect in one.effects]
    assert named and batch.effects == {name: named.count(name) for name in named}
    with pytest.raises(HdoptError, match="none of 1 recordings can be diagnosed; the first: .*broken.csv"):
        hdopt.diagnose_many([files[1]], source())


def test_each_goes_to_the_engine_and_a_dask_cluster_gives_the_same_bytes(batch, files, tmp_path, capsys):
    """Would catch a batch that stays in this process, and a row that cannot travel."""
    distributed = pytest.importorskip("distributed")
    items = []

    class Elsewhere(ThisProcess):
        elsewhere = True

        def map(self, function, given):
            items.extend(given := list(given))
            return super().map(function, given)

    with engine_in_force(Elsewhere()):
        assert hdopt.diagnose_many(files, source()) == batch
    assert items == files
    here = json.loads(json.dumps(batch.to_dict()))
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address.replace("tcp", "dask", 1)
        assert run("diagnose", *files, *GEAR, "--engine", address, "--json", tmp_path / "there.json") == 0
    there = json.loads((tmp_path / "there.json").read_text())
    assert {key: there[key] for key in here} == here
    assert {"d0.csv", "broken.csv", "d1.csv"} <= set(there["provenance"]["inputs"])
    said = capsys.readouterr().out
    assert "broken.csv: not diagnosed: " in said
    *_, verdicts, written = said.splitlines()
    assert verdicts.startswith("verdicts: ") and written.startswith("wrote ")


def test_page_and_tables_hold_every_drive(batch, tmp_path):
    page = tmp_path / "page.html"
    hdopt.workflow.diagnose_many.write_diagnoses(batch, {"report": page, "csv": tmp_path / "t.csv"})
    text = page.read_text()
    assert all(drive.name in text for drive in batch.drives) and "could not be diagnosed" in text
    table = pd.read_csv(tmp_path / "t.csv")
    assert list(table["name"]) == ["d0.csv", "broken.csv", "d1.csv"] and table["error"].notna().sum() == 1
    assert set(batch.tables()["parameters"]["name"]) == {drive.name for drive in batch.drives if drive.effects}
    assert len(batch.plot().data) == 2 and list(batch.plot().data[0].x) == ["d0.csv", "d1.csv"]


def test_a_batch_goes_on_where_it_was_interrupted(files, tmp_path, capsys, monkeypatch):
    """Would catch drives diagnosed twice, and an answer that an interruption changes."""
    import hdopt.workflow.diagnose_many as many
    from hdopt.cli import common

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(common, "QUIET_S", 0.0)
    asked = []

    def diagnosed(count):
        def one(recording, *others, **options):
            asked.append(recording.name)
            if len(asked) == count:
                raise KeyboardInterrupt
            fit = dict.fromkeys(hdopt.diagnosis.verdict.many.NUMBERS, 0.5)
            return SimpleNamespace(
                verdict="adequate", says=recording.name, effects=(), to_dict=lambda: {"effects": [], "fit": fit}
            )

        return one

    monkeypatch.setattr(many, "diagnose", diagnosed(3))
    assert run("diagnose", *files, *GEAR) == 130
    asked.clear()
    monkeypatch.setattr(many, "diagnose", diagnosed(0))
    assert run("diagnose", *files, *GEAR, "--resume") == 0
    assert asked == ["d1.csv"]
    assert capsys.readouterr().out.splitlines()[-1] == "verdicts: adequate 3"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--resume",), "give it with --each"),
        (("--each", "--write-study", "s.toml"), "--write-study: said of one drive"),
    ],
)
def test_options_that_do_not_go_together(words, message, files, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("diagnose", files[0], "--drive", "none", "--ratio", "7.2", *words) == 2
    assert message in capsys.readouterr().err
