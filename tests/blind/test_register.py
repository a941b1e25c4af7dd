"""A registered run: hashes that notice a change, a seed that nobody chose, answers that can be scored again."""

import json
import subprocess

import pytest

from hdopt.bench import page, register, registry
from hdopt.bench.score import main, score
from tests.blind.test_score import small_proof

NAME = "run-x"


def git(folder, *arguments):
    done = subprocess.run(
        ["git", "-c", "user.name=A", "-c", "user.email=a@b.c", *arguments], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def kept_run(tmp_path):
    """A run of made-up keys and answers, kept in a register of its own, as `register keep` leaves it."""
    answers, keys = small_proof()
    source, folder = tmp_path / "made", tmp_path / "docs" / "proof"
    for name in ("answers", "sealed", "baselines/order spectrum"):
        (source / name).mkdir(parents=True)
    text = registry.lines(keys)
    (source / "sealed" / "keys.jsonl").write_text(text)
    for name, answer in answers.items():
        (source / "answers" / f"{name}.json").write_text(json.dumps(answer | {"warnings": ["left out"]}))
    (source / "baselines" / "order spectrum" / "n0.json").write_text(json.dumps(answers["n0"]))
    run = register.open_run(folder, NAME, len(keys), 1.0)
    told = {"begun": len(keys), "seconds": 66.0, "program": run["program"]}
    (source / "answers.json").write_text(json.dumps(told))
    registry.put(folder, run | {"seed": 1, "commit": "c" * 40, "keys": registry.sha(text)})
    return folder, source


def test_a_changed_byte_of_a_source_changes_its_hash(tmp_path):
    """Catches a hash over names alone, and one that leaves a room out."""
    for room in (*registry.PROGRAM, "bench"):
        (tmp_path / room).mkdir()
        (tmp_path / room / "a.py").write_text("x = 1\n")
    (tmp_path / "diagnosis" / "settings.py").write_text("y = 1\n")
    before = registry.hashes(tmp_path)
    assert registry.hashes(tmp_path) == before
    for room in registry.PROGRAM:
        (tmp_path / room / "a.py").write_text("x = 2\n")
        after = registry.hashes(tmp_path)
        assert after["program"] != before["program"] and after["bench"] == before["bench"]
        before = after
    (tmp_path / "diagnosis" / "settings.py").write_text("y = 2\n")
    assert registry.hashes(tmp_path)["settings"] != before["settings"]


def test_the_seed_is_the_hash_of_the_commit_that_opened_the_run(tmp_path):
    """Catches a seed that could be chosen, or that later commits of the register move."""
    git(tmp_path, "init", "-q")
    register.open_run(tmp_path, NAME, 40, 35.0)
    with pytest.raises(ValueError, match="commit it first"):
        register.opening_commit(tmp_path, NAME)
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "open")
    opened = git(tmp_path, "rev-parse", "HEAD")
    registry.put(tmp_path, registry.entry(tmp_path, NAME) | {"note": "later"})
    git(tmp_path, "commit", "-qam", "more")
    for text in ("[]", (tmp_path / "register.json").read_text()):  # taken out and put in again: still the first
        (tmp_path / "register.json").write_text(text)
        git(tmp_path, "commit", "-qam", "again")
    assert register.opening_commit(tmp_path, NAME) == opened != git(tmp_path, "rev-parse", "HEAD")
    assert register.seed_of("0000002a" + "f" * 32) == 42
    with pytest.raises(ValueError, match="runs stay, good or bad"):
        register.open_run(tmp_path, NAME, 40, 35.0)


def test_a_changed_program_seals_nothing(tmp_path):
    register.open_run(tmp_path, NAME, 40, 35.0)
    registry.put(tmp_path, registry.entry(tmp_path, NAME) | {"program": "0" * 64})
    with pytest.raises(ValueError, match="program is not what run-x registered"):
        register.seal(tmp_path, NAME, tmp_path / "out")


def test_a_kept_run_scores_as_it_did(kept_run, capsys):
    """Catches a compact form that leaves out what is scored."""
    folder, source = kept_run
    run = register.keep(folder, NAME, source)
    again = score(*registry.kept(folder, NAME))
    assert again.summary() == score(*small_proof()).summary()
    assert run["figures"][""]["false_alarms"] == [2, 5]
    assert "left out" not in registry.read_xz(folder / f"{NAME}.answers.jsonl.xz")
    assert main(["--run", NAME, "--register", str(folder)]) == 1
    assert "false-alarm rate" in capsys.readouterr().out
    with pytest.raises(ValueError, match="no run 'other'"):
        registry.kept(folder, "other")


def test_cases_that_were_not_begun_are_not_scored(kept_run):
    folder, source = kept_run
    told = json.loads((source / "answers.json").read_text())
    (source / "answers.json").write_text(json.dumps(told | {"begun": 2}))
    register.keep(folder, NAME, source)
    assert len(registry.kept(folder, NAME)[1]) == 2


def test_another_program_or_changed_keys_and_answers_are_refused(kept_run):
    folder, source = kept_run
    told = json.loads((source / "answers.json").read_text())
    (source / "answers.json").write_text(json.dumps(told | {"program": "0" * 64}))
    with pytest.raises(ValueError, match="answered by another program"):
        register.keep(folder, NAME, source)
    (source / "answers.json").write_text(json.dumps(told))
    register.keep(folder, NAME, source)
    for part in ("keys", "answers"):
        path = folder / f"{NAME}.{part}.jsonl.xz"
        true = path.read_bytes()
        registry.write_xz(path, registry.read_xz(path).replace("resonance", "hysteresis", 1))
        with pytest.raises(ValueError, match=f"{part} are not those registered"):
            registry.kept(folder, NAME)
        path.write_bytes(true)


def test_the_page_shows_every_run_and_the_baselines_beside(kept_run):
    """Catches a page that leaves a run out: one that was opened and never answered stands on it too."""
    folder, source = kept_run
    register.keep(folder, NAME, source)
    register.open_run(folder, "run-never", 40, 35.0, "broken off")
    page.main(["--register", str(folder)])
    text = (folder.parent / "proof.md").read_text()
    assert "run-x" in text and "run-never" in text and "not answered" in text and "broken off" in text
    assert "| hdopt | order spectrum | goal |" in text
    assert "| false alarms (one-sided 95 % bound) | 2 of 5 (81 %) |" in text
    assert "| u2" not in text and "0.5-0.7" in text
    drawn = (folder / f"{NAME}.svg").read_text()
    assert drawn.count("<circle") == 2 and "4 of 4" in drawn
