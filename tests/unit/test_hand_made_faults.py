"""The list of hand-made faults fits the code that it is about."""

import sys
from collections import Counter
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest
from numba.core import caching

from tests.mutants import drawing, in_memory
from tests.mutants.faults import summary, with_sections, with_summary
from tests.mutants.hand_made import ROOT, faults_of, rooms
from tests.mutants.ledger import asked, digest_of, is_known, keep
from tests.mutants.machine_code import folder_of, imported

FAULTS = [fault for room in rooms() for fault in faults_of(room)]


@pytest.mark.parametrize("room", rooms())
def test_what_a_fault_changes_stands_there_once(room):
    """Where the line has changed, write the fault anew against it, or take it out of the list."""
    for fault in faults_of(room):
        text = (ROOT / fault.file).read_text(encoding="utf-8")
        assert text.count(fault.old) == 1, fault.name
        changed = text.replace(fault.old, fault.new)
        assert changed != text, fault.name
        compile(changed, fault.file, "exec")
        assert fault.tests, fault.name
        for test in fault.tests:
            file, _, named = test.partition("::")
            written = (ROOT / "tests" / file).read_text(encoding="utf-8")
            assert not named or f"def {named.split('[')[0]}(" in written, fault.name


def test_mechanical_mutants_are_drawn_alike_and_are_other_programs():
    """Would catch mutants of annotations, which nothing can notice, and of machine code, which takes minutes each."""
    drawn = [list(islice(drawing.drawn("mechanics"), 4)) for _ in range(2)]
    assert drawn[0] == drawn[1] and len({one.name for one in drawn[0]}) == 4
    assert all(drawing._program(one.old) != drawing._program(one.new) and one.tests for one in drawn[0])
    noted = "def f(a: float | None) -> int:\n    b: int = 1\n    return b\n"
    assert drawing._program(noted) == drawing._program(noted.replace("float | None", "float & None"))
    assert drawing._program(noted) != drawing._program(noted.replace("= 1", "= 2"))
    kinematics = ROOT / "hdopt" / "kinematics"
    assert [drawing._is_compiled(kinematics / f"{name}.py") for name in ("kernel", "closed_form", "exact")] == [1, 1, 0]


def test_every_fault_has_a_name_of_its_own():
    assert [name for name, count in Counter((f.room, f.name) for f in FAULTS).items() if count > 1] == []


def test_a_room_that_was_run_takes_the_place_of_its_old_section():
    page = "# Head\n\nText.\n\n## beta\n\nold\n\n## gamma\n\nstays\n"
    found = with_sections(page, {"beta": "## beta\n\nnew\n", "alpha": "## alpha\n\nfirst\n"})
    assert found == "# Head\n\nText.\n\n## alpha\n\nfirst\n\n## beta\n\nnew\n\n## gamma\n\nstays\n"


def test_the_page_says_how_many_were_asked():
    faults = [replace(FAULTS[0], name=name, equivalent="") for name in "abc"]
    answers = {faults[0].key: ["killed", digest_of(faults[0], faults[0].tests[:1]), faults[0].tests[0]]}
    answers[faults[1].key] = ["survived", "", ""]
    said = summary([*faults, replace(faults[0], name="d", equivalent="nothing to see")], answers)
    assert said.startswith(
        "Of 3 faults on the lists 2 have been asked: all but 1 are noticed; 1 are not asked yet.\n1 of "
    )
    page = "# Head\n\nOf 9 faults on the lists some\nlines.\n\nMore.\n"
    assert with_summary(page, said) == f"# Head\n\n{said}\nMore.\n"


def test_an_answer_holds_while_its_file_and_the_test_that_gave_it_stand(tmp_path):
    """Would catch an answer that is kept for a text it was not given for."""
    kept = tmp_path / "asked.json"
    fault = FAULTS[0]
    by = fault.tests[0]
    keep(fault, ["killed", digest_of(fault, (by,)), by], kept)
    assert is_known(fault, asked(kept))
    keep(fault, ["survived", digest_of(fault), ""], kept)
    assert not is_known(fault, asked(kept))
    keep(fault, ["killed", digest_of(fault), by], kept)
    assert is_known(fault, asked(kept)) == (len(fault.tests) == 1)
    assert not is_known(replace(fault, new=fault.new + "#"), asked(kept))


def test_functions_tell_that_they_were_called():
    path = Path(in_memory.__file__)
    text = path.read_text(encoding="utf-8")
    changed = in_memory.changed_functions(path, text, text.replace("found = frozenset(", "found = set("))
    assert changed == {"changed_functions"}
    called: list[int] = []
    function = in_memory.changed_functions
    before = function.__code__
    sys._fault_called = called.append  # type: ignore[attr-defined]
    try:
        in_memory.mark_calls(path, text, changed, 7)
        assert function(path, text, text) == frozenset()
    finally:
        function.__code__ = before
        del sys._fault_called  # type: ignore[attr-defined]
    assert called == [7]


def test_machine_code_of_what_imports_a_fault_is_made_anew_and_no_other(tmp_path):
    """Would catch a fault in a file that a kernel takes in, asked of the kernel as it was compiled without it."""
    texts = {
        "__init__": "",
        "rows": "from hdopt import constants\ndef row(): pass\n",
        "constants": "MARGIN = 1.0\n",
        "turn": "from hdopt.rows import (\n    row,\n)\n\n@entry\ndef block(): pass\n",
        "noise": "@njit(cache=True)\ndef filtered(): pass\n",
    }
    tree, kept = tmp_path / "tree", tmp_path / "compiled"
    (tree / "hdopt").mkdir(parents=True)
    for name, text in texts.items():
        (tree / "hdopt" / f"{name}.py").write_text(text)
    sound = folder_of(tree, kept)
    assert folder_of(tree, kept) == sound
    below = sound / caching._CacheLocator.get_suitable_cache_subpath(str(tree / "hdopt" / "turn.py"))
    below.mkdir(exist_ok=True)
    for name in ("turn.block-3.py311.nbi", "turn.block-3.py311.1.nbc", "noise.filtered-1.py311.nbi"):
        (below / name).write_text(name)
    for name in ("rows", "constants"):
        path = tree / "hdopt" / f"{name}.py"
        path.write_text(texts[name] + "# a fault\n")
        faulty = folder_of(tree, kept)
        assert faulty != sound and [one.name for one in faulty.rglob("*.nb?")] == ["noise.filtered-1.py311.nbi"], name
        path.write_text(texts[name])
    assert folder_of(tree, kept) == sound and len(list(below.iterdir())) == 3


def test_a_kernel_knows_the_files_that_are_compiled_into_it():
    sources = {path.relative_to(ROOT).as_posix(): path.read_bytes() for path in (ROOT / "hdopt").rglob("*.py")}
    turn = imported(sources, "hdopt/simulation/turn/kernel.py")
    beat = imported(sources, "hdopt/simulation/beat/kernel.py")
    lanes = {f"hdopt/kinematics/lanes/{name}.py" for name in ("compiled", "minima", "motion", "single")}
    assert turn > lanes | {f"hdopt/simulation/turn/{name}.py" for name in ("lows", "rows", "scan", "tops")}
    own = ("edges", "gather", "looks", "parts", "turns")
    assert beat > lanes | {f"hdopt/simulation/beat/{name}.py" for name in own}
    assert not any("simulation" in name for name in imported(sources, "hdopt/kinematics/kernel.py"))
