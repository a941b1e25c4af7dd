"""The list of hand-made faults fits the code that it is about."""

from collections import Counter

import pytest

from tests.mutants.faults import with_sections
from tests.mutants.hand_made import ROOT, faults_of, rooms

FAULTS = [fault for room in rooms() for fault in faults_of(room)]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: f"{fault.room}: {fault.name}")
def test_what_a_fault_changes_stands_there_once(fault):
    """Where the line has changed, write the fault anew against it, or take it out of the list."""
    text = (ROOT / fault.file).read_text(encoding="utf-8")
    assert text.count(fault.old) == 1
    changed = text.replace(fault.old, fault.new)
    assert changed != text
    compile(changed, fault.file, "exec")
    assert fault.tests
    for test in fault.tests:
        assert (ROOT / "tests" / test).is_file()


def test_every_fault_has_a_name_of_its_own():
    assert [name for name, count in Counter((f.room, f.name) for f in FAULTS).items() if count > 1] == []


def test_a_room_that_was_run_takes_the_place_of_its_old_section():
    page = "# Head\n\nText.\n\n## beta\n\nold\n\n## gamma\n\nstays\n"
    found = with_sections(page, {"beta": "## beta\n\nnew\n", "alpha": "## alpha\n\nfirst\n"})
    assert found == "# Head\n\nText.\n\n## alpha\n\nfirst\n\n## beta\n\nnew\n\n## gamma\n\nstays\n"
