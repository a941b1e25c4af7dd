"""Every command says what it said when its golden answer was renewed (`python -m tests.regression.renew commands`)."""

import pytest

from tests.regression.commands import COMMANDS, answer
from tests.regression.golden import compact, differences, stored

GOLDEN = stored("commands")


@pytest.mark.parametrize(
    "command", [pytest.param(c, marks=[pytest.mark.slow] if c.slow else [], id=c.name) for c in COMMANDS]
)
def test_command_says_what_it_said(command, request):
    if command.name == "run csf-25-80":
        run = request.getfixturevalue("shipped_run")
        said = {"status": run.status, "json": compact(run.result)}
    else:
        said = answer(command)
    moved = differences(GOLDEN[command.name], said, command.relative)
    assert not moved, "\n".join(moved)


def test_no_golden_answer_is_left_over():
    assert set(GOLDEN) == {command.name for command in COMMANDS}
