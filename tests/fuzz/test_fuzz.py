"""A few hundred inputs of each kind at every check; `make fuzz` goes on for as long as it is let."""

import pytest
from hypothesis import HealthCheck, given, settings

from tests.fuzz.rule import KINDS

EXAMPLES = {"studies": 60, "numbers": 30, "recordings": 100, "cams": 40, "allocations": 200, "options": 60}
MANY = 500


def check(kind, folder, examples):
    strategy, rule = KINDS[kind]

    @settings(
        max_examples=examples, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
    )
    @given(strategy)
    def one(content):
        rule(content, folder)

    one()


@pytest.mark.parametrize("kind", KINDS)
def test_some_of_each_kind(kind, tmp_path):
    check(kind, tmp_path, EXAMPLES[kind])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_many_of_each_kind(kind, tmp_path):
    check(kind, tmp_path, MANY)
