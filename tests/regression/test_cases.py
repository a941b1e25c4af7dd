"""Short bench cases are answered as they were (`python -m tests.regression.renew cases`)."""

import pytest

from tests.regression.cases import FITTED, SPECS, answer
from tests.regression.golden import differences, stored

GOLDEN = stored("cases")
QUICK = ("nothing 2000", "encoder_input_eccentricity 1.0", "mains 1.0")
"""Those that `make check` answers."""


# From the last to the first: `tests/unit/test_named_cases.py`, which another worker may be at, goes the other way. So
# the two meet once, and do not wait for each other at every case.
IN_TURN = [pytest.param(n, marks=[] if n in QUICK else [pytest.mark.slow], id=n) for n in reversed(SPECS)]


@pytest.mark.parametrize("name", IN_TURN)
def test_case_is_answered_as_before(name, session_answers):
    moved = differences(GOLDEN[name], answer(name, session_answers), FITTED)
    assert not moved, "\n".join(moved)


def test_no_answer_is_left_over():
    assert set(GOLDEN) == set(SPECS)
